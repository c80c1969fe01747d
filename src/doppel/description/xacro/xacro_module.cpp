// xacro's own functions: xacro.load_yaml, xacro.message and the others; and $(eval ...).
#include <fmt/format.h>

#include <cstdlib>

#include "doppel/description/xacro/detail/expression_functions.h"
#include "doppel/description/xacro/detail/xacro.h"
#include "doppel/description/xacro/detail/xacro_yaml.h"

namespace doppel::xacro {
namespace {

std::string message_text(const ValueList& arguments) {
  std::string out;
  for (const Value& a : arguments) out += (out.empty() ? "" : " ") + a.str();
  return out;
}

Value tokenise_text(ValueList& a, KeywordArguments& keywords) {
  const std::string text = text_argument(a, 0, "tokenize");
  std::string separators = a.size() > 1 ? text_argument(a, 1, "tokenize") : ",; ";
  bool skip_empty = a.size() > 2 ? a[2].truth() : true;
  for (const auto& [name, value] : keywords) {
    if (name == "sep")
      separators = value.str();
    else if (name == "skip_empty")
      skip_empty = value.truth();
    else
      throw ExpressionError(fmt::format("tokenize() takes no argument '{}'", name));
  }
  ValueList out;
  for (std::size_t i = 0; i <= text.size();) {
    const std::size_t end = std::min(text.find_first_of(separators, i), text.size());
    if (end > i || !skip_empty) out.emplace_back(text.substr(i, end - i));
    i = end + 1;
  }
  return Value::list(std::move(out));
}

ValueFunction saying(Interpreter& interpreter, Severity severity) {
  return [&interpreter, severity](ValueList& a, KeywordArguments&) {
    interpreter.diagnostics().add(
        {severity, "xacro.message", message_text(a), locate(interpreter.here()), ""});
    return Value("");
  };
}

// The names in $(eval ...): its own functions, then the arguments, as numbers where possible.
class EvalScope : public NameScope {
 public:
  EvalScope(Interpreter& interpreter, const TreePlace& where) : interpreter_(interpreter) {
    const auto one = [](ValueList& a) { return text_argument(a, 0, "$(eval ...)"); };
    add("arg", [this, one, where](ValueList& a, KeywordArguments&) {
      return converted(interpreter_.argument(one(a), where));
    });
    add("find", [this, one, where](ValueList& a, KeywordArguments&) {
      return Value(std::string(interpreter_.package(one(a), where)));
    });
    add("dirname", [this](ValueList&, KeywordArguments&) {
      const auto file = std::filesystem::absolute(interpreter_.beside("x"));
      return Value(file.lexically_normal().parent_path().string());
    });
    add("optenv", [one](ValueList& a, KeywordArguments&) {
      const char* value = std::getenv(one(a).c_str());
      return value != nullptr ? Value(value) : a.size() > 1 ? a[1] : Value("");
    });
    add("env", [one](ValueList& a, KeywordArguments&) {
      const char* value = std::getenv(one(a).c_str());
      if (value == nullptr)
        throw ExpressionError(fmt::format("environment variable '{}' is not set", one(a)),
                              "xacro.environment");
      return Value(value);
    });
    names_["true"] = Value(true);
    names_["false"] = Value(false);
  }

  const Value* find(std::string_view name) override {
    if (const auto known = names_.find(name); known != names_.end()) return &known->second;
    if (find_builtin(name) != nullptr) return nullptr;
    const auto given = interpreter_.arguments().find(name);
    if (given == interpreter_.arguments().end()) return nullptr;
    return &(names_[std::string(name)] = converted(given->second));
  }
  [[nodiscard]] std::vector<std::string> names() const override {
    std::vector<std::string> out;
    for (const auto& [name, value] : names_) out.push_back(name);
    for (const auto& [name, value] : interpreter_.arguments()) out.push_back(name);
    return out;
  }

 private:
  void add(const char* name, ValueFunction f) { names_[name] = Value::function(name, std::move(f)); }
  static Value converted(const std::string& text) {
    double real = 0;
    const bool point = text.find('.') != std::string::npos;
    if (point && parse_real(text, real)) return Value(real);
    if (auto whole = point ? std::nullopt : parse_whole(text)) return *std::move(whole);
    const Value lower = (*get_attribute(Value(text), "lower").as<Value::Function>().call)(none_, nothing_);
    if (lower.str() == "true" || lower.str() == "false") return Value(lower.str() == "true");
    return Value(text);
  }

  Interpreter& interpreter_;
  std::map<std::string, Value, std::less<>> names_;
  static inline ValueList none_;
  static inline KeywordArguments nothing_;
};

}  // namespace

std::string eval_substitution(std::string_view text, Interpreter& interpreter, const TreePlace& where) {
  try {
    EvalScope scope(interpreter, where);
    const Value value = evaluate(interpreter.compiled(text), scope, interpreter.budget().steps);
    if (value.is<Value::Function>()) throw ExpressionError(fmt::format("{} is a function", value.repr()));
    return value.str();
  } catch (const ExpressionError& problem) {
    throw InputError(problem.rule, locate(where),
                     fmt::format("{} (in $(eval {}))", problem.what(), excerpt(text)));
  }
}

Value dotted(const Value& value) {
  if (value.is<Value::Dict>()) {
    ValueDict out;
    for (const auto& [key, item] : value.as<Value::Dict>().entries->dict) out.set(key, dotted(item));
    return Value::dict(std::move(out), true);
  }
  if (!value.is<Value::List>()) return value;
  ValueList out;
  for (const Value& item : value.values()) out.push_back(dotted(item));
  return Value::list(std::move(out));
}

TextTable<Value> xacro_globals(Interpreter& interpreter) {
  FunctionTable t;
  TextTable<Value> out;
  const auto add = [&t](const char* name, ValueFunction f) { t[name] = Value::function(name, std::move(f)); };
  // Available with and without "xacro." in front.
  const auto add_global = [&](const char* name, ValueFunction f) {
    add(name, std::move(f));
    out.set(name, t[name]);
  };
  add_global("load_yaml", [&interpreter](ValueList& a, KeywordArguments&) {
    return interpreter.yaml(text_argument(a, 0, "load_yaml"), interpreter.here());
  });
  add_global("abs_filename", [&interpreter](ValueList& a, KeywordArguments&) {
    return Value(interpreter.beside(text_argument(a, 0, "abs_filename")).string());
  });
  add_global("dotify", [](ValueList& a, KeywordArguments&) {
    if (a.size() != 1 || !a[0].is<Value::Dict>()) throw ExpressionError("dotify() needs a dict");
    return dotted(a[0]);
  });
  add("arg", [&interpreter](ValueList& a, KeywordArguments&) {
    return Value(interpreter.argument(text_argument(a, 0, "arg"), interpreter.here()));
  });
  add("tokenize", tokenise_text);
  add("message", saying(interpreter, Severity::note));
  add("warning", saying(interpreter, Severity::warning));
  add("error", saying(interpreter, Severity::warning));
  add("print_location", [&interpreter](ValueList&, KeywordArguments&) {
    interpreter.diagnostics().note("xacro.message", locate(interpreter.here()), "print_location()");
    return Value("");
  });
  add("fatal", [](ValueList& a, KeywordArguments&) -> Value {
    throw ExpressionError(message_text(a), "xacro.fatal");
  });
  out.set("xacro", Value::object("xacro", std::make_shared<Module>(std::move(t))));
  return out;
}

}  // namespace doppel::xacro
