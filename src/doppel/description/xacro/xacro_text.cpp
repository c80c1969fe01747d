// Texts with ${...} and $(...) in them.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "doppel/base/core/names.h"
#include "doppel/description/xacro/detail/xacro.h"

namespace doppel::xacro {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kParsed = 16;  // the cost of a parsed character: the tree is larger than the text

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> out;
  for (std::size_t i = 0; (i = text.find_first_not_of(' ', i)) != std::string_view::npos;) {
    const std::size_t end = std::min(text.find(' ', i), text.size());
    out.push_back(text.substr(i, end - i));
    i = end + 1;
  }
  return out;
}

// Restores the value that it points to at destruction.
template <class T>
class ScopedAssignment {
 public:
  ScopedAssignment(T& place, T value) : place_(place), before_(place) { place = value; }
  ~ScopedAssignment() { place_ = before_; }
  ScopedAssignment(const ScopedAssignment&) = delete;
  ScopedAssignment& operator=(const ScopedAssignment&) = delete;

 private:
  T& place_;
  T before_;
};

// $${ is ${, not evaluated.
void cut_text(std::string_view text, const TreePlace& where, std::vector<TextPart>& out) {
  const auto plain = [&out](std::string_view piece) {
    if (!piece.empty()) out.push_back({TextPart::Kind::plain, piece, nullptr});
  };
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t dollar = std::min(text.find('$', i), text.size());
    const std::size_t last = std::min(text.find_first_not_of('$', dollar), text.size());
    const char opens = last < text.size() ? text[last] : '\0';
    if (opens != '{' && opens != '(') {
      if (last - dollar > 1) {
        throw InputError(
            "xacro.expression", locate(where),
            fmt::format("'{}' is followed by neither '{{' nor '('", text.substr(dollar, last - dollar)),
            "write one '$' for the character itself, $${ for '${'");
      }
      plain(text.substr(i, last - i));
      i = last;
      continue;
    }
    plain(text.substr(i, dollar - i));
    if (last - dollar > 1) {
      plain(text.substr(dollar + 1, last - dollar));
      i = last + 1;
      continue;
    }
    const std::size_t end = text.find(opens == '{' ? '}' : ')', last);
    if (end == std::string_view::npos) {
      throw InputError("xacro.expression", locate(where),
                       fmt::format("'{}' is not closed", text.substr(dollar)),
                       fmt::format("close it with '{}'", opens == '{' ? '}' : ')'));
    }
    out.push_back({opens == '{' ? TextPart::Kind::expression : TextPart::Kind::substitution,
                   text.substr(last + 1, end - last - 1), nullptr});
    i = end + 1;
  }
}

const TreeNode* find_declaration(const TreeNode& node, std::string_view argument) {
  for (const TreeNode* child = node.first; child != nullptr; child = child->next) {
    const TreeAttribute* const name = child->is("xacro:arg") ? child->find("name") : nullptr;
    if (name != nullptr && name->value == argument) return child;
    if (const TreeNode* const found = find_declaration(*child, argument)) return found;
  }
  return nullptr;
}

}  // namespace

Interpreter::Interpreter(const PackageResolver& resolver, Diagnostics& diagnostics)
    : resolver_(resolver), diagnostics_(diagnostics), globals_(xacro_globals(*this)) {}

void Interpreter::charge(std::size_t characters, const TreePlace& where) {
  budget_.characters -= static_cast<std::int64_t>(characters);
  if (budget_.characters < 0)
    throw InputError("xacro.too_much", locate(where), "the expansion grows without bound",
                     "look for a property or macro that repeats itself");
}

std::span<const TextPart> Interpreter::parts(std::string_view text, const TreePlace& where) {
  const std::uint32_t hash = text_hash(text);
  if (const auto* const known = texts_.find(text, hash)) return *known;
  charge(text.size(), where);
  cutting_.clear();
  cut_text(text, where, cutting_);
  for (TextPart& part : cutting_) {
    if (part.kind != TextPart::Kind::expression || part.text.find('$') != std::string_view::npos) continue;
    try {
      part.expression = &compiled(part.text);
    } catch (const ExpressionError&) {
      continue;  // reported at its evaluation, with its place
    }
  }
  return texts_.set(text, arena().copy(std::span<const TextPart>(cutting_)));
}

const Expression& Interpreter::compiled(std::string_view text) {
  const std::uint32_t hash = text_hash(text);
  if (const auto* const known = expressions_.find(text, hash)) return **known;
  charge(kParsed * text.size(), here());
  return *expressions_.set(text, parse_expression(text, store_));
}

Value Interpreter::text(std::string_view text, Scope& scope, const TreePlace& where) {
  if (text.find('$') == std::string_view::npos) return Value(std::string(text));
  if (StackGuard::exhausted()) {
    throw InputError("xacro.too_deep", locate(where), "properties and expressions are nested too deeply here",
                     "look for one that depends on itself");
  }
  const ScopedAssignment<const TreePlace*> here(here_, &where);
  const std::span<const TextPart> cut = parts(text, where);
  if (cut.size() == 1) return part(cut.front(), scope, where);
  std::string out;
  for (const TextPart& piece : cut) {
    if (piece.kind == TextPart::Kind::plain) {
      out += piece.text;
      continue;
    }
    const Value value = part(piece, scope, where);
    if (value.is<std::string>())
      out += value.as<std::string>();
    else
      out += value.str();
  }
  charge(out.size(), where);
  return Value(std::move(out));
}

std::string_view Interpreter::string(std::string_view text, Scope& scope, const TreePlace& where) {
  if (text.find('$') == std::string_view::npos) return text;
  const Value value = this->text(text, scope, where);
  const std::string_view out =
      value.is<std::string>() ? arena().copy(value.as<std::string>()) : arena().copy(value.str());
  charge(out.size(), where);
  return out;
}

Value Interpreter::part(const TextPart& part, Scope& scope, const TreePlace& where) {
  switch (part.kind) {
    case TextPart::Kind::plain:
      return Value(std::string(part.text));
    case TextPart::Kind::substitution:
      return Value(std::string(substitution(string(part.text, scope, where), where)));
    case TextPart::Kind::expression:
      break;
  }
  if (part.expression != nullptr) return evaluated(*part.expression, part.text, scope, where);
  const std::string_view inner = string(part.text, scope, where);
  try {
    return evaluated(compiled(inner), inner, scope, where);
  } catch (const ExpressionError& problem) {
    throw InputError(problem.rule, locate(where),
                     fmt::format("{} (in ${{{}}})", problem.what(), excerpt(inner)));
  }
}

Value Interpreter::evaluated(const Expression& expression, std::string_view text, Scope& scope,
                             const TreePlace& where) {
  try {
    return evaluate(expression, scope, budget_.steps);
  } catch (const ExpressionError& problem) {
    throw InputError(problem.rule, locate(where),
                     fmt::format("{} (in ${{{}}})", problem.what(), excerpt(text)));
  }
}

const std::string& Interpreter::argument(std::string_view name, const TreePlace& where) {
  if (!used_arguments_.contains(name)) used_arguments_.emplace(name);
  if (const auto found = arguments_.find(name); found != arguments_.end()) return found->second;
  for (const TreeNode* root : documents_) {
    if (const TreeNode* const late = find_declaration(*root, name)) {
      throw InputError(
          "xacro.undefined_argument", locate(where),
          fmt::format("undefined substitution argument '{}': it is declared at {}, which is not read "
                      "before this place",
                      name, locate(late->where).place()),
          fmt::format("move the <xacro:arg> up, before its first use, or pass {}:=...", name));
    }
  }
  std::vector<std::string> names;
  for (const auto& [known, value] : arguments_) names.push_back(known);
  throw InputError(
      "xacro.undefined_argument", locate(where),
      fmt::format("undefined substitution argument '{}'{}", name, did_you_mean(name, names)),
      fmt::format("pass {}:=..., or declare <xacro:arg name=\"{}\" default=\"...\"/> before this line", name,
                  name));
}

std::string_view Interpreter::package(std::string_view name, const TreePlace& where) {
  if (const auto* const known = packages_.find(name)) return *known;
  const PackageResolver::Resolved found = resolver_.find_package(std::string(name));
  if (!found.path.empty()) return packages_.set(arena().copy(name), arena().copy(found.path.string()));
  std::string tried;
  for (const std::string& place : found.tried) tried += "\n    " + place;
  throw InputError(
      "xacro.package_not_found", locate(where),
      fmt::format("package '{}' is not found{}{}", name,
                  found.nearest.empty() ? "" : fmt::format("; did you mean '{}'?", found.nearest),
                  tried.empty() ? "" : (found.nearest.empty() ? ". Looked in:" : " Looked in:") + tried),
      "put the package next to this one, or add it to ROS_PACKAGE_PATH");
}

// $(...) of a text without anything else, then $(find ...) in the result.
std::string_view Interpreter::substitution(std::string_view inner, const TreePlace& where) {
  const std::string_view made = command(inner, where);
  if (made.find("$(find ") == std::string_view::npos) return made;
  std::string out(made);
  for (std::size_t at = 0; (at = out.find("$(find ", at)) != std::string::npos;) {
    const std::size_t end = out.find(')', at);
    if (end == std::string::npos) break;
    const std::vector<std::string_view> named = words(std::string_view(out).substr(at + 6, end - at - 6));
    const std::string_view folder = package(named.empty() ? "" : named.front(), where);
    out.replace(at, end - at + 1, folder);
    at += folder.size();
  }
  return arena().copy(out);
}

std::string_view Interpreter::command(std::string_view inner, const TreePlace& where) {
  if (inner.starts_with("eval ")) return arena().copy(eval_substitution(inner.substr(5), *this, where));
  const std::vector<std::string_view> given = words(inner);
  const std::string_view name = given.empty() ? std::string_view() : given[0];
  if (name == "cwd") return arena().copy(fs::current_path().string());
  if (name == "dirname")
    return arena().copy(fs::absolute(beside("x")).lexically_normal().parent_path().string());
  if (name != "find" && name != "arg" && name != "env" && name != "optenv") {
    const std::vector<std::string> commands{"find", "arg", "env", "optenv", "dirname", "eval", "cwd"};
    throw InputError("xacro.substitution", locate(where),
                     fmt::format("unknown substitution command '{}' in $({}){}", name, inner,
                                 did_you_mean(name, commands)));
  }
  if (given.size() < 2 || (given.size() > 2 && name != "optenv"))
    throw InputError("xacro.substitution", locate(where), fmt::format("$({}) needs exactly one name", inner));
  if (name == "find") return package(given[1], where);
  if (name == "arg") return argument(given[1], where);
  if (const char* value = std::getenv(std::string(given[1]).c_str())) return arena().copy(value);
  if (name == "env") {
    throw InputError("xacro.environment", locate(where),
                     fmt::format("environment variable '{}' is not set", given[1]),
                     fmt::format("set it, or write $(optenv {} DEFAULT)", given[1]));
  }
  std::string fallback;
  for (std::size_t i = 2; i < given.size(); ++i) fallback.append(i > 2 ? " " : "").append(given[i]);
  return arena().copy(fallback);
}

bool Interpreter::condition(std::string_view raw, Scope& scope, const TreePlace& where) {
  const Value value = text(raw, scope, where);
  if (const auto truth = truth_of(value)) return *truth;
  throw InputError(
      "xacro.not_boolean", locate(where),
      fmt::format("the condition '{}' evaluates to '{}', which is not a boolean", raw, value.str()),
      "use true, false, 1, 0, or a comparison in ${...}");
}

fs::path Interpreter::beside(std::string_view name) const {
  fs::path path(name);
  if (path.is_absolute() || reading_.empty()) return path;
  return reading_.back().parent_path() / path;
}

void Interpreter::add_file(const fs::path& file) {
  if (known_files_.insert(file.string()).second) files_.push_back(file);
}

std::string Interpreter::include_loop() const {
  if (reading_.empty()) return "";
  const auto before = std::find(std::next(reading_.rbegin()), reading_.rend(), reading_.back());
  if (before == reading_.rend()) return "";
  std::string out;
  for (auto at = before.base() - 1; at != reading_.end(); ++at)
    out += (out.empty() ? "" : " -> ") + at->filename().string();
  return out;
}

void Interpreter::warn_of_global(std::string_view name) {
  if (find_builtin(name) == nullptr && global(name) == nullptr) return;
  if (!warned_.emplace(name).second) return;
  diagnostics_.warning("xacro.redefines", locate(here()),
                       fmt::format("'{}' is a built-in name of xacro, which is redefined here", name),
                       "choose another name; expressions below see this one");
}

Value Interpreter::yaml(const std::string& name, const TreePlace& where) {
  const fs::path file = beside(name);
  if (const auto known = yaml_files_.find(file.string()); known != yaml_files_.end()) return known->second;
  add_file(file);
  return yaml_files_.emplace(file.string(), load_yaml(file, where)).first->second;
}

}  // namespace doppel::xacro
