// Includes.
#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>

#include "doppel/base/core/files_read.h"
#include "doppel/base/core/names.h"
#include "doppel/description/xacro/detail/xacro_expander.h"

namespace doppel::xacro {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxEntries = 100'000;  // of folders, visited for one pattern

// Files whose path matches a shell pattern, in order of their names, independent of the locale.
struct Matches {
  explicit Matches(const fs::path& pattern) {
    for (const fs::path& part : pattern.relative_path()) parts_.push_back(part);
    look(pattern.root_path(), 0);
    std::sort(found.begin(), found.end());
  }
  std::vector<fs::path> found;
  bool too_many = false;

 private:
  void look(const fs::path& at, std::size_t next) {
    std::error_code none;
    if (next == parts_.size()) {
      if (fs::exists(at, none)) found.push_back(at);
      return;
    }
    const std::string part = parts_[next].string();
    if (part.find_first_of("*?[") == std::string::npos) return look(at / part, next + 1);
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(at.empty() ? fs::path(".") : at, none)) {
      if (++looked_ > kMaxEntries) {
        too_many = true;
        return;
      }
      if (fnmatch(part.c_str(), entry.path().filename().c_str(), FNM_PERIOD) == 0)
        names.push_back(entry.path().filename().string());
    }
    for (const std::string& name : names) {
      if (!too_many) look(at / name, next + 1);
    }
  }

  std::vector<fs::path> parts_;
  int looked_ = 0;
};

}  // namespace

std::vector<fs::path> Expander::included_files(std::string_view name, const TreePlace& where, bool optional) {
  const fs::path path = interpreter_.beside(name);
  if (path.native().find_first_of("*?[") != std::string::npos) {
    Matches matches(path);
    if (matches.too_many)
      throw InputError("xacro.too_much", locate(where),
                       fmt::format("'{}' matches too many files", path.string()));
    std::vector<fs::path> out = std::move(matches.found);
    if (out.empty())
      diagnostics_.warning("xacro.no_match", locate(where),
                           fmt::format("no file matches '{}'", path.string()));
    return out;
  }
  FilesRead::note(path);
  std::error_code none;
  if (fs::exists(path, none)) return {path};
  if (optional) return {};
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(path.parent_path(), none))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  throw InputError("xacro.file_not_found", locate(where),
                   fmt::format("the file '{}' does not exist{}", path.string(),
                               did_you_mean(path.filename().string(), names)));
}

// Each file is read once, however often it is included.
const TreeNode& Expander::document(const fs::path& file, const Context& inside) {
  const auto known = parsed_.find(file.native());
  if (known != parsed_.end()) return *known->second;
  try {
    XmlTree read = load_xml_tree(file.string(), keep_);
    sources_.insert(sources_.end(), read.sources.begin(), read.sources.end());
    audit_document(read, *inside.within);
    interpreter_.add_document(*read.root);
    return *(parsed_[file.native()] = read.root);
  } catch (const InputError& problem) {
    Diagnostic located = problem.diagnostics().front();
    located.where.within = steps_of(inside.within);
    throw InputError(located);
  }
}

void Expander::lift_namespaces(const TreeAttribute* from, Output& out, const Context& context) {
  for (const TreeAttribute* a = from; a != nullptr; a = a->next) {
    if (!a->name.starts_with("xmlns:") || a->name == "xmlns:xacro") continue;
    const TreeAttribute* const known = out.parent->find(a->name);
    if (known == nullptr) {
      TreeAttribute made = *a;
      made.where = placed(made.where, context);
      out.parent->set(made, arena_);
    } else if (known->value != a->value) {
      diagnostics_.warning("xacro.namespace", location_of(a->where, context),
                           fmt::format("{} is '{}' here, and '{}' at {}", a->name, a->value, known->value,
                                       locate(known->where).place()));
    }
  }
}

void Expander::include_file(const fs::path& file, const Context& inside, Output& out) {
  const TreeNode& root = document(file, inside);
  interpreter_.add_file(file);
  const Interpreter::Reading reading(interpreter_, file);
  Attributes made = attributes(root, inside);
  Output inner = make_output(&made);
  children(root, inside, inner);
  lift_namespaces(made.first(), out, inside);
  out.nodes.append(inner.nodes);
}

void Expander::include(const TreeNode& in, const Context& context, Output& out) {
  check_attributes(in, {"filename", "ns", "optional"}, context);
  const TreeAttribute& filename = required(in, "filename", context);
  Context names = context;
  if (const TreeAttribute* space = in.find("ns"); space != nullptr && !space->value.empty()) {
    const std::string_view name = text_of(*space, context);
    const auto macros = std::make_shared<MacroTable>();
    const auto scope = std::make_shared<Scope>(interpreter_, context.scope, Scope::Kind::space);
    context.macros->add_namespace(name, macros);
    context.scope->add_namespace(name, scope);
    names.macros = macros.get();
    names.scope = scope.get();
  }
  for (const TreeNode* child = in.first; child != nullptr; child = child->next) {
    if (child->kind != TreeNode::Kind::element) continue;
    diagnostics_.warning("xacro.include", location_of(in.where, context),
                         "elements in <xacro:include> are ignored");
    break;
  }
  const bool optional = condition_of(in.find("optional"), false, context);
  const std::string_view wanted = text_of(filename, context);
  Output made = make_output(out.parent);
  for (const fs::path& file : included_files(wanted, placed(filename.where, context), optional))
    include_file(file, deeper(in, names, "in include", ""), made);
  drop_comments(in, out);
  out.nodes.append(made.nodes);
}

}  // namespace doppel::xacro
