// Includes.
#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>

#include "doppel/core/names.h"
#include "doppel/description/xacro_expander.h"

namespace doppel::xacro {
namespace {

namespace fs = std::filesystem;

constexpr int kMostEntries = 100'000;  // of folders, looked at for one pattern

// Files whose path fits a shell's pattern, in order of their names, whatever the locale.
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
      if (++looked_ > kMostEntries) {
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

std::vector<fs::path> Expander::included_files(const std::string& name, const SourceLocation& where,
                                               bool optional) {
  const fs::path path = interpreter_.beside(name);
  if (path.string().find_first_of("*?[") != std::string::npos) {
    Matches matches(path);
    if (matches.too_many)
      throw InputError("xacro.too_much", where, fmt::format("'{}' looks into too many files", path.string()));
    std::vector<fs::path> out = std::move(matches.found);
    if (out.empty())
      diagnostics_.warning("xacro.no_match", where, fmt::format("no file matches '{}'", path.string()));
    return out;
  }
  std::error_code none;
  if (fs::exists(path, none)) return {path};
  if (optional) return {};
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(path.parent_path(), none))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  throw InputError("xacro.file_not_found", where,
                   fmt::format("the file '{}' does not exist{}", path.string(),
                               did_you_mean(path.filename().string(), names)));
}

// Each file is read once, however often it is included.
const XmlNode& Expander::document(const fs::path& file, const Context& inside) {
  const auto known = parsed_.find(file.string());
  if (known != parsed_.end()) return *known->second;
  try {
    documents_.push_back(load_xml_document(file.string(), keep_));
  } catch (const InputError& problem) {
    Diagnostic told = problem.diagnostics().front();
    told.where.within = inside.within;
    throw InputError(told);
  }
  return *(parsed_[file.string()] = &documents_.back().root);
}

void Expander::lift_namespaces(const std::vector<XmlAttribute>& from, Output& out, const Context& context) {
  for (const XmlAttribute& a : from) {
    if (!a.name.starts_with("xmlns:") || a.name == "xmlns:xacro") continue;
    const auto known = std::find_if(out.parent->begin(), out.parent->end(),
                                    [&a](const XmlAttribute& other) { return other.name == a.name; });
    if (known == out.parent->end())
      out.parent->push_back(a);
    else if (known->value != a.value)
      diagnostics_.warning("xacro.namespace", placed(a.where, context),
                           fmt::format("{} is '{}' here, and '{}' at {}", a.name, a.value, known->value,
                                       known->where.place()));
  }
}

void Expander::include_file(const fs::path& file, const Context& inside, Output& out) {
  const XmlNode& root = document(file, inside);
  interpreter_.add_file(file);
  const Interpreter::Reading reading(interpreter_, file);
  std::vector<XmlAttribute> made;
  attributes(root, inside, made);
  Output inner = make_output(&made);
  children(root, inside, inner);
  lift_namespaces(made, out, inside);
  std::move(inner.nodes.begin(), inner.nodes.end(), std::back_inserter(out.nodes));
}

void Expander::include(const Child& child, const Context& context, Output& out) {
  const XmlNode& in = child.node;
  check_attributes(in, {"filename", "ns", "optional"}, context);
  const XmlAttribute& filename = required(in, "filename", context);
  const SourceLocation where = placed(filename.where, context);
  Context names = context;
  if (const XmlAttribute* space = in.find("ns"); space != nullptr && !space->value.empty()) {
    const std::string name = value_of(*space, context).str();
    const auto macros = std::make_shared<MacroTable>();
    const auto scope = std::make_shared<Scope>(interpreter_, context.scope, Scope::Kind::space);
    context.macros->add_namespace(name, macros);
    context.scope->add_namespace(name, scope);
    names.macros = macros.get();
    names.scope = scope.get();
  }
  if (std::any_of(in.children.begin(), in.children.end(),
                  [](const XmlNode& n) { return n.kind == XmlNode::Kind::element; }))
    diagnostics_.warning("xacro.include", placed(in.where, context),
                         "elements in <xacro:include> are ignored");
  const bool optional = condition_of(in.find("optional"), false, context);
  const std::string wanted = value_of(filename, context).str();
  Output made = make_output(out.parent);
  for (const fs::path& file : included_files(wanted, where, optional))
    include_file(file, deeper(in, names, "in include"), made);
  drop_comments(child, out);
  std::move(made.nodes.begin(), made.nodes.end(), std::back_inserter(out.nodes));
}

}  // namespace doppel::xacro
