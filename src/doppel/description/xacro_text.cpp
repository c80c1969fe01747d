// Texts with ${...} and $(...) in them.
#include <fmt/format.h>

#include <cstdlib>

#include "doppel/core/names.h"
#include "doppel/description/xacro_detail.h"

namespace doppel::xacro {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostCached = 20'000;

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> out;
  for (std::size_t i = 0; (i = text.find_first_not_of(' ', i)) != std::string::npos;) {
    const std::size_t end = std::min(text.find(' ', i), text.size());
    out.push_back(text.substr(i, end - i));
    i = end;
  }
  return out;
}

// Restores what it points to when it goes.
template <class T>
class Restored {
 public:
  Restored(T& place, T value) : place_(place), before_(place) { place = value; }
  ~Restored() { place_ = before_; }
  Restored(const Restored&) = delete;
  Restored& operator=(const Restored&) = delete;

 private:
  T& place_;
  T before_;
};

}  // namespace

std::vector<TextPart> cut_text(const std::string& text, const SourceLocation& where) {
  std::vector<TextPart> out;
  std::string plain;
  const auto flush = [&] {
    if (!plain.empty()) out.push_back({TextPart::Kind::plain, std::exchange(plain, ""), nullptr});
  };
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t dollar = std::min(text.find('$', i), text.size());
    plain += text.substr(i, dollar - i);
    if (dollar == text.size()) break;
    const std::size_t last = std::min(text.find_first_not_of('$', dollar), text.size());
    const char opens = last < text.size() ? text[last] : '\0';
    if (opens != '{' && opens != '(') {
      plain += text.substr(dollar, last - dollar);
      i = last;
      continue;
    }
    if (last - dollar > 1) {  // $${ is ${, not evaluated
      plain += text.substr(dollar + 1, last - dollar);
      i = last + 1;
      continue;
    }
    const std::size_t end = text.find(opens == '{' ? '}' : ')', last);
    if (end == std::string::npos) {
      throw InputError("xacro.expression", where, fmt::format("'{}' is not closed", text.substr(dollar)),
                       fmt::format("close it with '{}'", opens == '{' ? '}' : ')'));
    }
    flush();
    out.push_back({opens == '{' ? TextPart::Kind::expression : TextPart::Kind::substitution,
                   text.substr(last + 1, end - last - 1), nullptr});
    i = end + 1;
  }
  flush();
  return out;
}

Interpreter::Interpreter(const PackageResolver& resolver, Diagnostics& diagnostics)
    : resolver_(resolver), diagnostics_(diagnostics), globals_(xacro_globals(*this)) {}

const std::vector<TextPart>& Interpreter::parts(const std::string& text, const SourceLocation& where) {
  if (const auto known = texts_.find(text); known != texts_.end()) return known->second;
  std::vector<TextPart> cut = cut_text(text, where);
  for (TextPart& part : cut) {
    if (part.kind != TextPart::Kind::expression || part.text.find('$') != std::string::npos) continue;
    try {
      part.expression = compiled(part.text);
    } catch (const ExpressionError&) {
      continue;  // told when it is evaluated, with its place
    }
  }
  if (texts_.size() >= kMostCached) {
    uncached_ = std::move(cut);
    return uncached_;
  }
  return texts_.emplace(text, std::move(cut)).first->second;
}

std::shared_ptr<const Expression> Interpreter::compiled(const std::string& text) {
  if (const auto known = expressions_.find(text); known != expressions_.end()) return known->second;
  auto made = parse_expression(text);
  if (expressions_.size() < kMostCached) expressions_.emplace(text, made);
  return made;
}

Value Interpreter::text(const std::string& text, Scope& scope, const SourceLocation& where) {
  if (text.find('$') == std::string::npos) return Value(text);
  if (StackGuard::exhausted()) {
    throw InputError("xacro.too_deep", where, "properties and expressions are nested too deeply here",
                     "look for one that needs itself");
  }
  const Restored<const SourceLocation*> here(here_, &where);
  const std::vector<TextPart>* cut = &parts(text, where);
  std::vector<TextPart> own;
  if (cut == &uncached_) {  // may be replaced while its parts are evaluated
    own = std::move(uncached_);
    cut = &own;
  }
  if (cut->size() == 1) return part(cut->front(), scope, where);
  std::string out;
  for (const TextPart& piece : *cut) {
    if (piece.kind == TextPart::Kind::plain)
      out += piece.text;
    else
      out += part(piece, scope, where).str();
  }
  budget_.characters -= static_cast<std::int64_t>(out.size());
  if (budget_.characters < 0)
    throw InputError("xacro.too_much", where, "the expansion grows without end",
                     "look for a property or macro that doubles itself");
  return Value(std::move(out));
}

std::string Interpreter::string(const std::string& text, Scope& scope, const SourceLocation& where) {
  if (text.find('$') == std::string::npos) return text;
  std::string out = this->text(text, scope, where).str();
  budget_.characters -= static_cast<std::int64_t>(out.size());
  return out;
}

Value Interpreter::part(const TextPart& part, Scope& scope, const SourceLocation& where) {
  switch (part.kind) {
    case TextPart::Kind::plain:
      return Value(part.text);
    case TextPart::Kind::substitution:
      return Value(substitution(string(part.text, scope, where), where));
    case TextPart::Kind::expression:
      break;
  }
  if (part.expression) return evaluated(*part.expression, part.text, scope, where);
  const std::string inner = string(part.text, scope, where);
  try {
    return evaluated(*compiled(inner), inner, scope, where);
  } catch (const ExpressionError& problem) {
    throw InputError(problem.rule, where, fmt::format("{} (in ${{{}}})", problem.what(), excerpt(inner)));
  }
}

Value Interpreter::evaluated(const Expression& expression, const std::string& text, Scope& scope,
                             const SourceLocation& where) {
  try {
    return evaluate(expression, scope, budget_.steps);
  } catch (const ExpressionError& problem) {
    throw InputError(problem.rule, where, fmt::format("{} (in ${{{}}})", problem.what(), excerpt(text)));
  }
}

Value Interpreter::argument(const std::string& name, const SourceLocation& where) {
  used_arguments_.insert(name);
  if (const auto found = arguments_.find(name); found != arguments_.end()) return Value(found->second);
  std::vector<std::string> names;
  for (const auto& [known, value] : arguments_) names.push_back(known);
  throw InputError(
      "xacro.undefined_argument", where,
      fmt::format("undefined substitution argument '{}'{}", name, did_you_mean(name, names)),
      fmt::format("give {}:=..., or declare <xacro:arg name=\"{}\" default=\"...\"/> before this line", name,
                  name));
}

std::string Interpreter::package(const std::string& name, const SourceLocation& where) const {
  const PackageResolver::Resolved found = resolver_.find_package(name);
  if (!found.path.empty()) return found.path.string();
  std::string tried;
  for (const std::string& place : found.tried) tried += "\n    " + place;
  throw InputError(
      "xacro.package_not_found", where,
      fmt::format("package '{}' is not found{}{}", name,
                  found.nearest.empty() ? "" : fmt::format("; did you mean '{}'?", found.nearest),
                  tried.empty() ? "" : ". Looked in:" + tried),
      "put the package beside this one, or into ROS_PACKAGE_PATH");
}

// $(...) of a text that holds nothing else, then $(find ...) in what came out.
std::string Interpreter::substitution(const std::string& inner, const SourceLocation& where) {
  std::string out = command(inner, where);
  for (std::size_t at = 0; (at = out.find("$(find ", at)) != std::string::npos;) {
    const std::size_t end = out.find(')', at);
    if (end == std::string::npos) break;
    const std::string folder = package(words(out.substr(at + 6, end - at - 6)).front(), where);
    out.replace(at, end - at + 1, folder);
    at += folder.size();
  }
  return out;
}

std::string Interpreter::command(const std::string& inner, const SourceLocation& where) {
  const std::vector<std::string> given = words(inner);
  const std::string name = given.empty() ? "" : given[0];
  if (inner.starts_with("eval ")) return eval_substitution(inner.substr(5), *this, where);
  if (name == "cwd") return fs::current_path().string();
  if (name == "dirname") return fs::absolute(beside("x")).lexically_normal().parent_path().string();
  const std::vector<std::string> commands{"find", "arg", "env", "optenv", "dirname", "eval", "cwd"};
  if (name != "find" && name != "arg" && name != "env" && name != "optenv") {
    throw InputError("xacro.substitution", where,
                     fmt::format("unknown substitution command '{}' in $({}){}", name, inner,
                                 did_you_mean(name, commands)));
  }
  if (given.size() < 2 || (given.size() > 2 && name != "optenv"))
    throw InputError("xacro.substitution", where, fmt::format("$({}) needs one name", inner));
  if (name == "find") return package(given[1], where);
  if (name == "arg") return argument(given[1], where).str();
  if (const char* value = std::getenv(given[1].c_str())) return value;
  if (name == "env") {
    throw InputError("xacro.environment", where,
                     fmt::format("environment variable '{}' is not set", given[1]),
                     fmt::format("set it, or write $(optenv {} DEFAULT)", given[1]));
  }
  std::string fallback;
  for (std::size_t i = 2; i < given.size(); ++i) fallback += (i > 2 ? " " : "") + given[i];
  return fallback;
}

bool Interpreter::condition(const std::string& raw, Scope& scope, const SourceLocation& where) {
  const Value value = text(raw, scope, where);
  if (const auto truth = truth_of(value)) return *truth;
  throw InputError(
      "xacro.not_boolean", where,
      fmt::format("the condition '{}' evaluates to '{}', which is not a boolean", raw, value.str()),
      "use true, false, 1, 0, or a comparison in ${...}");
}

fs::path Interpreter::beside(const std::string& name) const {
  const fs::path path(name);
  if (path.is_absolute() || reading_.empty()) return path;
  return reading_.back().parent_path() / path;
}

void Interpreter::add_file(const fs::path& file) {
  if (std::find(files_.begin(), files_.end(), file) == files_.end()) files_.push_back(file);
}

const Value* Interpreter::global(const std::string& name) const {
  const auto found = globals_.find(name);
  return found == globals_.end() ? nullptr : &found->second;
}

void Interpreter::warn_of_global(const std::string& name) {
  if (find_builtin(name) == nullptr && global(name) == nullptr) return;
  if (!warned_.insert(name).second) return;
  diagnostics_.warning("xacro.redefines", here(),
                       fmt::format("'{}' is a name of xacro's own, which is redefined here", name),
                       "choose another name; expressions below see this one");
}

Value Interpreter::yaml(const std::string& name, const SourceLocation& where) {
  const fs::path file = beside(name);
  if (const auto known = yaml_files_.find(file.string()); known != yaml_files_.end()) return known->second;
  add_file(file);
  return yaml_files_.emplace(file.string(), load_yaml(file, where)).first->second;
}

}  // namespace doppel::xacro
