// Texts with ${...} and $(...) in them.
#include <fmt/format.h>

#include <cstdlib>

#include "doppel/core/names.h"
#include "doppel/description/xacro_detail.h"

namespace doppel::xacro {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepestText = 60;  // properties that are made of properties that are made of ...

std::pair<std::string, std::string> first_word(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos) return {};
  const std::size_t end = text.find_first_of(" \t\r\n", begin);
  if (end == std::string::npos) return {text.substr(begin), ""};
  const std::size_t rest = text.find_first_not_of(" \t\r\n", end);
  if (rest == std::string::npos) return {text.substr(begin, end - begin), ""};
  return {text.substr(begin, end - begin), text.substr(rest, text.find_last_not_of(" \t\r\n") - rest + 1)};
}

}  // namespace

Value Interpreter::text(const std::string& text, Scope& scope, const SourceLocation& where) {
  if (text.find('$') == std::string::npos) return Value(text);
  if (++depth_ > kDeepestText) {
    depth_ = 0;
    throw InputError("xacro.too_deep", where, "properties and expressions are nested too deeply here",
                     "look for one that needs itself");
  }
  std::vector<Value> parts;
  const auto add = [&parts](const std::string& plain) {
    if (!parts.empty() && parts.back().is<std::string>())
      parts.back() = Value(parts.back().as<std::string>() + plain);
    else
      parts.emplace_back(plain);
  };
  bool plain_only = true;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t dollar = std::min(text.find('$', i), text.size());
    if (dollar > i) add(text.substr(i, dollar - i));
    if (dollar == text.size()) break;
    const std::size_t last = std::min(text.find_first_not_of('$', dollar), text.size());
    const char opens = last < text.size() ? text[last] : '\0';
    if (opens != '{' && opens != '(') {
      add(text.substr(dollar, last - dollar));
      i = last;
      continue;
    }
    if (last - dollar > 1) {  // $${ is ${, not evaluated
      add(text.substr(dollar + 1, last - dollar));
      i = last + 1;
      continue;
    }
    const std::size_t end = text.find(opens == '{' ? '}' : ')', last);
    if (end == std::string::npos) {
      throw InputError("xacro.expression", where, fmt::format("'{}' is not closed", text.substr(dollar)),
                       fmt::format("close it with '{}'", opens == '{' ? '}' : ')'));
    }
    const std::string inner = text.substr(last + 1, end - last - 1);
    Value value = opens == '{' ? expression(inner, scope, where) : substitution(inner, scope, where);
    plain_only = false;
    parts.push_back(std::move(value));
    i = end + 1;
  }
  --depth_;
  if (parts.size() == 1 && !plain_only) return parts[0];
  std::string out;
  for (const Value& part : parts) out += part.str();
  budget_.characters -= static_cast<std::int64_t>(out.size());
  if (budget_.characters < 0)
    throw InputError("xacro.too_much", where, "the expansion grows without end",
                     "look for a property or macro that doubles itself");
  return Value(out);
}

Value Interpreter::expression(const std::string& raw, Scope& scope, const SourceLocation& where) {
  const std::string inner = text(raw, scope, where).str();
  // `xacro` and its functions need to know where they are called.
  class WithModule : public NameScope {
   public:
    WithModule(Interpreter& interpreter, Scope& scope, const SourceLocation& where)
        : interpreter_(interpreter), scope_(scope), where_(where) {}
    std::optional<Value> find(const std::string& name) override {
      if (auto known = scope_.find(name)) return known;
      if (name == "xacro") return interpreter_.xacro_module(where_);
      if (name == "load_yaml") return interpreter_.xacro_module(where_).get(Value("load_yaml"))[0];
      return std::nullopt;
    }
    [[nodiscard]] std::vector<std::string> names() const override { return scope_.names(); }

   private:
    Interpreter& interpreter_;
    Scope& scope_;
    const SourceLocation& where_;
  } names(*this, scope, where);
  try {
    return evaluate(inner, names, budget_.steps);
  } catch (const ExpressionError& problem) {
    depth_ = 0;
    throw InputError(problem.rule, where, fmt::format("{} (in ${{{}}})", problem.what(), inner));
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
      fmt::format("package '{}' is not found{}. Looked in:{}", name,
                  found.nearest.empty() ? "" : fmt::format("; did you mean '{}'?", found.nearest), tried),
      "put the package beside this one, or into ROS_PACKAGE_PATH");
}

Value Interpreter::substitution(const std::string& raw, Scope& scope, const SourceLocation& where) {
  const auto [command, rest] = first_word(text(raw, scope, where).str());
  if (command == "find") return Value(package(rest, where));
  if (command == "arg") return argument(rest, where);
  if (command == "dirname") return Value(relative_to(where, ".").lexically_normal().parent_path().string());
  if (command == "cwd") return Value(fs::current_path().string());
  if (command == "eval") return expression(rest, scope, where);
  if (command == "anon") return Value(rest);
  if (command == "env" || command == "optenv") {
    const auto [name, fallback] = first_word(rest);
    if (const char* value = std::getenv(name.c_str())) return Value(std::string(value));
    if (command == "optenv") return Value(fallback);
    throw InputError("xacro.environment", where, fmt::format("environment variable '{}' is not set", name),
                     fmt::format("set it, or write $(optenv {} DEFAULT)", name));
  }
  const std::vector<std::string> commands{"find", "arg", "env", "optenv", "dirname", "eval", "cwd", "anon"};
  throw InputError(
      "xacro.substitution", where,
      fmt::format("unknown substitution command '{}'{}", command, did_you_mean(command, commands)));
}

bool Interpreter::condition(const std::string& raw, Scope& scope, const SourceLocation& where) {
  const Value value = text(raw, scope, where);
  if (!value.is<std::string>()) return value.truth();
  const Value read = literal(value.as<std::string>());
  if (read.integral()) return read.truth();
  throw InputError(
      "xacro.not_boolean", where,
      fmt::format("the condition '{}' evaluates to '{}', which is not a boolean", raw, value.str()),
      "use true, false, 1, 0, or a comparison in ${...}");
}

fs::path Interpreter::relative_to(const SourceLocation& where, const std::string& name) const {
  const fs::path path(name);
  if (path.is_absolute() || !where.known()) return path;
  std::error_code none;
  return fs::absolute(fs::path(*where.file), none).parent_path() / path;
}

Value Interpreter::xacro_module(const SourceLocation& where) {
  const auto joined = [](const ValueList& arguments) {
    std::string out;
    for (const Value& a : arguments) out += (out.empty() ? "" : " ") + a.str();
    return out;
  };
  const auto yaml = [this, where](ValueList& a, KeywordArguments&) {
    if (a.empty()) throw ExpressionError("load_yaml() needs a file");
    const fs::path file = relative_to(where, a[0].str());
    files_.push_back(file);
    return load_yaml(file, where);
  };
  const auto say = [this, where, joined](Severity severity) {
    return [this, where, joined, severity](ValueList& a, KeywordArguments&) {
      if (severity == Severity::error) throw ExpressionError(joined(a), "xacro.fatal");
      diagnostics_.add({severity, "xacro.message", joined(a), where, ""});
      return Value("");
    };
  };
  const auto named = [](const char* name, ValueFunction f) {
    return std::pair{Value(name), Value::function(name, std::move(f))};
  };
  return Value::dict({
      named("load_yaml", yaml),
      named("arg", [this, where](ValueList& a,
                                 KeywordArguments&) { return argument(a.empty() ? "" : a[0].str(), where); }),
      named("message", say(Severity::note)),
      named("warning", say(Severity::warning)),
      named("error", say(Severity::warning)),
      named("fatal", say(Severity::error)),
      named("abs_filename",
            [this, where](ValueList& a, KeywordArguments&) {
              return Value(relative_to(where, a.empty() ? "" : a[0].str()).string());
            }),
      named("dotify", [](ValueList& a, KeywordArguments&) { return a.empty() ? Value() : a[0]; }),
      named("tokenize",
            [](ValueList& a, KeywordArguments&) {
              std::string text = a.empty() ? "" : a[0].str();
              for (char& c : text) c = c == ',' || c == ';' ? ' ' : c;
              ValueList none;
              KeywordArguments nothing;
              return (*get_attribute(Value(text), "split").as<Value::Function>().call)(none, nothing);
            }),
  });
}

}  // namespace doppel::xacro
