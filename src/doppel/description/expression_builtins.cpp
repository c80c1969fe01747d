// Python's built-ins, the math module and the methods of strings, lists and dicts that robot descriptions
// use.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "doppel/core/names.h"
#include "doppel/description/expression.h"
#include "doppel/description/urdf_reader.h"

namespace doppel {
namespace {

using Arguments = ValueList;

double real(const Arguments& a, std::size_t i, const char* function) {
  if (i >= a.size()) throw ExpressionError(fmt::format("{}() needs more arguments", function));
  if (!a[i].number())
    throw ExpressionError(
        fmt::format("{}() needs a number, not '{}' ({})", function, a[i].str(), a[i].type_name()));
  return a[i].real();
}

const std::string& text(const Arguments& a, std::size_t i, const char* function) {
  if (i >= a.size() || !a[i].is<std::string>())
    throw ExpressionError(fmt::format("{}() needs a string", function));
  return a[i].as<std::string>();
}

ValueList sequence(const Arguments& a, std::size_t i, const char* function) {
  ValueList out;
  if (i >= a.size() || !a[i].items(out))
    throw ExpressionError(fmt::format("{}() needs something with items", function));
  return out;
}

Value extreme(const Arguments& a, const char* function, bool largest) {
  const ValueList items = a.size() == 1 ? sequence(a, 0, function) : a;
  if (items.empty()) throw ExpressionError(fmt::format("{}() of nothing", function));
  Value best = items[0];
  for (std::size_t i = 1; i < items.size(); ++i) {
    const bool more = real(items, i, function) > best.real(), less = items[i].real() < best.real();
    if (largest ? more : less) best = items[i];
  }
  return best;
}

Value to_int(const Arguments& a) {
  if (a.empty()) return Value(std::int64_t{0});
  if (a[0].is<std::string>()) {
    const auto parsed = parse_number(a[0].as<std::string>());
    if (!parsed || *parsed != std::floor(*parsed))
      throw ExpressionError(fmt::format("int() of '{}'", a[0].as<std::string>()));
    return Value(static_cast<std::int64_t>(*parsed));
  }
  const double value = real(a, 0, "int");
  if (a[0].integral()) return Value(a[0].integer());
  if (!(std::abs(value) < 9e18)) throw ExpressionError("int() of a number that is too large");
  return Value(static_cast<std::int64_t>(value));
}

Value to_float(const Arguments& a) {
  if (!a.empty() && a[0].is<std::string>()) {
    const auto parsed = parse_number(a[0].as<std::string>());
    if (!parsed) throw ExpressionError(fmt::format("float() of '{}'", a[0].as<std::string>()));
    return Value(*parsed);
  }
  return Value(a.empty() ? 0.0 : real(a, 0, "float"));
}

Value round_to(const Arguments& a) {
  const double value = real(a, 0, "round");
  if (a.size() < 2) return Value(static_cast<std::int64_t>(std::nearbyint(value)));
  const double digits = real(a, 1, "round");
  return Value(std::stod(fmt::format("{:.{}f}", value, static_cast<int>(std::clamp(digits, 0.0, 17.0)))));
}

Value range(const Arguments& a) {
  const auto at = [&](std::size_t i) { return static_cast<std::int64_t>(real(a, i, "range")); };
  const std::int64_t from = a.size() < 2 ? 0 : at(0), to = at(a.size() < 2 ? 0 : 1),
                     step = a.size() < 3 ? 1 : at(2);
  if (step == 0 || std::abs(static_cast<double>(to - from) / static_cast<double>(step)) > 1e6)
    throw ExpressionError("range() is too long");
  ValueList out;
  for (std::int64_t i = from; step > 0 ? i < to : i > to; i += step) out.emplace_back(i);
  return Value::list(std::move(out));
}

Value make_dict(const Arguments& a, const KeywordArguments& keywords) {
  ValueDict out;
  if (!a.empty()) {
    if (a[0].is<Value::Dict>()) {
      out = *a[0].as<Value::Dict>().items;
    } else {
      for (const Value& entry : sequence(a, 0, "dict")) {
        ValueList pair;
        if (!entry.items(pair) || pair.size() != 2) throw ExpressionError("dict() needs pairs");
        out.emplace_back(pair[0], pair[1]);
      }
    }
  }
  for (const auto& [name, value] : keywords) out.emplace_back(Value(name), value);
  return Value::dict(std::move(out));
}

Value sorted(const Arguments& a) {
  ValueList items = sequence(a, 0, "sorted");
  const bool strings =
      std::all_of(items.begin(), items.end(), [](const Value& v) { return v.is<std::string>(); });
  const bool numbers = std::all_of(items.begin(), items.end(), [](const Value& v) { return v.number(); });
  if (!strings && !numbers) throw ExpressionError("sorted() needs items of one kind");
  std::stable_sort(items.begin(), items.end(), [strings](const Value& l, const Value& r) {
    return strings ? l.as<std::string>() < r.as<std::string>() : l.real() < r.real();
  });
  return Value::list(std::move(items));
}

Value zip(const Arguments& a) {
  ValueList out;
  std::vector<ValueList> lists;
  for (std::size_t i = 0; i < a.size(); ++i) lists.push_back(sequence(a, i, "zip"));
  for (std::size_t row = 0; !lists.empty(); ++row) {
    ValueList tuple;
    for (const ValueList& list : lists) {
      if (row >= list.size()) return Value::list(std::move(out));
      tuple.push_back(list[row]);
    }
    out.push_back(Value::tuple(std::move(tuple)));
  }
  return Value::list(std::move(out));
}

Value sum(const Arguments& a) {
  bool integral = true;
  double total = 0;
  std::int64_t whole = 0;
  const ValueList items = sequence(a, 0, "sum");
  for (std::size_t i = 0; i < items.size(); ++i) {
    total += real(items, i, "sum");
    integral = integral && items[i].integral() && !__builtin_add_overflow(whole, items[i].integer(), &whole);
  }
  return integral ? Value(whole) : Value(total);
}

using Table = std::map<std::string, Value, std::less<>>;

void add_function(Table& table, const char* name, std::function<Value(const Arguments&)> f) {
  table[name] = Value::function(name, [f = std::move(f)](ValueList& a, KeywordArguments&) { return f(a); });
}

Table math_table() {
  Table t;
  const auto one = [&t](const char* name, double (*f)(double)) {
    add_function(t, name, [f, name](const Arguments& a) {
      const double result = f(real(a, 0, name));
      if (std::isnan(result)) throw ExpressionError(fmt::format("{}({}) has no value", name, a[0].str()));
      return Value(result);
    });
  };
  one("sin", std::sin), one("cos", std::cos), one("tan", std::tan), one("asin", std::asin),
      one("acos", std::acos);
  one("atan", std::atan), one("sqrt", std::sqrt), one("exp", std::exp), one("fabs", std::fabs),
      one("sinh", std::sinh);
  one("cosh", std::cosh), one("tanh", std::tanh), one("log10", std::log10), one("log2", std::log2);
  one("radians", [](double d) { return d * (std::numbers::pi / 180.0); });
  one("degrees", [](double r) { return r * (180.0 / std::numbers::pi); });
  const auto two = [&t](const char* name, double (*f)(double, double)) {
    add_function(t, name,
                 [f, name](const Arguments& a) { return Value(f(real(a, 0, name), real(a, 1, name))); });
  };
  two("atan2", std::atan2), two("pow", std::pow), two("hypot", std::hypot), two("fmod", std::fmod),
      two("copysign", std::copysign);
  add_function(t, "log", [](const Arguments& a) {
    const double value = std::log(real(a, 0, "log"));
    return Value(a.size() > 1 ? value / std::log(real(a, 1, "log")) : value);
  });
  for (const auto& [name, f] : {std::pair{"floor", +[](double v) { return std::floor(v); }},
                                std::pair{"ceil", +[](double v) { return std::ceil(v); }},
                                std::pair{"trunc", +[](double v) { return std::trunc(v); }}}) {
    add_function(t, name, [f = f, name = name](const Arguments& a) {
      return Value(static_cast<std::int64_t>(f(real(a, 0, name))));
    });
  }
  t["pi"] = Value(std::numbers::pi);
  t["e"] = Value(std::numbers::e);
  t["tau"] = Value(2 * std::numbers::pi);
  t["inf"] = Value(HUGE_VAL);
  t["nan"] = Value(std::nan(""));
  return t;
}

ValueDict as_dict(const Table& table) {
  ValueDict out;
  for (const auto& [name, value] : table) out.emplace_back(Value(name), value);
  return out;
}

Table builtin_table() {
  Table t;
  add_function(t, "abs", [](const Arguments& a) {
    const double value = real(a, 0, "abs");
    return a[0].integral() ? Value(std::abs(a[0].integer())) : Value(std::abs(value));
  });
  add_function(t, "min", [](const Arguments& a) { return extreme(a, "min", false); });
  add_function(t, "max", [](const Arguments& a) { return extreme(a, "max", true); });
  add_function(t, "int", to_int);
  add_function(t, "float", to_float);
  add_function(t, "str", [](const Arguments& a) { return Value(a.empty() ? std::string() : a[0].str()); });
  add_function(t, "bool", [](const Arguments& a) { return Value(!a.empty() && a[0].truth()); });
  add_function(t, "round", round_to);
  add_function(t, "len", [](const Arguments& a) {
    return Value(static_cast<std::int64_t>(sequence(a, 0, "len").size()));
  });
  add_function(t, "range", range);
  add_function(t, "list", [](const Arguments& a) {
    return Value::list(a.empty() ? ValueList{} : sequence(a, 0, "list"));
  });
  add_function(t, "tuple", [](const Arguments& a) {
    return Value::tuple(a.empty() ? ValueList{} : sequence(a, 0, "tuple"));
  });
  add_function(t, "set", [](const Arguments& a) {
    return Value::list(a.empty() ? ValueList{} : sequence(a, 0, "set"));
  });
  add_function(t, "sorted", sorted);
  add_function(t, "sum", sum);
  add_function(t, "zip", zip);
  add_function(t, "any", [](const Arguments& a) {
    const ValueList items = sequence(a, 0, "any");
    return Value(std::any_of(items.begin(), items.end(), [](const Value& v) { return v.truth(); }));
  });
  add_function(t, "all", [](const Arguments& a) {
    const ValueList items = sequence(a, 0, "all");
    return Value(std::all_of(items.begin(), items.end(), [](const Value& v) { return v.truth(); }));
  });
  add_function(t, "enumerate", [](const Arguments& a) {
    ValueList out;
    for (const Value& item : sequence(a, 0, "enumerate"))
      out.push_back(Value::tuple({Value(static_cast<std::int64_t>(out.size())), item}));
    return Value::list(std::move(out));
  });
  add_function(t, "map", [](const Arguments& a) {
    if (a.empty() || !a[0].is<Value::Function>()) throw ExpressionError("map() needs a function");
    ValueList out;
    for (const Value& item : sequence(a, 1, "map")) {
      ValueList arguments{item};
      KeywordArguments none;
      out.push_back((*a[0].as<Value::Function>().call)(arguments, none));
    }
    return Value::list(std::move(out));
  });
  t["dict"] = Value::function("dict", [](ValueList& a, KeywordArguments& k) { return make_dict(a, k); });
  return t;
}

const Table& builtins() {
  static const Table table = [] {
    Table t = builtin_table();
    const Table math = math_table();
    t["python"] = Value::dict(as_dict(t));
    t.insert(math.begin(), math.end());
    t["math"] = Value::dict(as_dict(math));
    return t;
  }();
  return table;
}

Value split(const std::string& subject, const Arguments& a) {
  ValueList out;
  if (a.empty() || a[0].is<Value::None>()) {
    for (std::size_t i = 0; (i = subject.find_first_not_of(" \t\r\n", i)) != std::string::npos;) {
      const std::size_t end = std::min(subject.find_first_of(" \t\r\n", i), subject.size());
      out.emplace_back(subject.substr(i, end - i));
      i = end;
    }
    return Value::list(std::move(out));
  }
  const std::string& separator = text(a, 0, "split");
  if (separator.empty()) throw ExpressionError("split() by nothing");
  std::size_t begin = 0;
  for (std::size_t end; (end = subject.find(separator, begin)) != std::string::npos;
       begin = end + separator.size()) {
    out.emplace_back(subject.substr(begin, end - begin));
  }
  out.emplace_back(subject.substr(begin));
  return Value::list(std::move(out));
}

Value joined(const std::string& separator, const Arguments& a) {
  std::string out;
  bool first = true;
  for (const Value& item : sequence(a, 0, "join")) {
    if (!item.is<std::string>())
      throw ExpressionError(fmt::format("join() needs strings, not '{}'", item.str()));
    out += (first ? "" : separator) + item.as<std::string>();
    first = false;
  }
  return Value(out);
}

Value replaced(std::string subject, const Arguments& a) {
  const std::string &from = text(a, 0, "replace"), &to = text(a, 1, "replace");
  if (from.empty()) return Value(subject);
  for (std::size_t i = 0; (i = subject.find(from, i)) != std::string::npos; i += to.size())
    subject.replace(i, from.size(), to);
  return Value(subject);
}

// "{} {0} {name} {:.3f}".format(...)
Value formatted(const std::string& format, const Arguments& a, const KeywordArguments& keywords) {
  std::string out;
  std::size_t next = 0;
  for (std::size_t i = 0; i < format.size(); ++i) {
    const bool doubled = i + 1 < format.size() && format[i + 1] == format[i];
    if ((format[i] == '{' || format[i] == '}') && doubled) {
      out += format[i++];
      continue;
    }
    if (format[i] != '{') {
      out += format[i];
      continue;
    }
    const std::size_t end = format.find('}', i);
    if (end == std::string::npos) throw ExpressionError("format() needs a closing brace");
    const std::string field = format.substr(i + 1, end - i - 1);
    i = end;
    const std::string name = field.substr(0, field.find(':'));
    const std::string spec = field.find(':') == std::string::npos ? "" : field.substr(field.find(':') + 1);
    const Value* value = nullptr;
    const bool position = name.empty() || std::all_of(name.begin(), name.end(),
                                                      [](unsigned char c) { return std::isdigit(c) != 0; });
    if (position) {
      const std::size_t at = name.empty() ? next++ : std::stoul(name.substr(0, 6));
      if (at < a.size()) value = &a[at];
    }
    for (const auto& [key, given] : keywords) {
      if (key == name) value = &given;
    }
    if (value == nullptr) throw ExpressionError(fmt::format("format() has no value for '{{{}}}'", field));
    try {
      if (spec.empty())
        out += value->str();
      else if (value->is<double>())
        out += fmt::format(fmt::runtime("{:" + spec + "}"), value->as<double>());
      else if (value->integral())
        out += fmt::format(fmt::runtime("{:" + spec + "}"), value->integer());
      else
        out += fmt::format(fmt::runtime("{:" + spec + "}"), value->str());
    } catch (const fmt::format_error& problem) {
      throw ExpressionError(
          fmt::format("the format '{}' does not fit '{}': {}", spec, value->str(), problem.what()));
    }
  }
  return Value(out);
}

std::string stripped(const std::string& subject, const Arguments& a, bool left, bool right) {
  const std::string characters = a.empty() ? " \t\r\n" : text(a, 0, "strip");
  const std::size_t begin = left ? subject.find_first_not_of(characters) : 0;
  if (begin == std::string::npos) return "";
  const std::size_t end = right ? subject.find_last_not_of(characters) : subject.size() - 1;
  return end == std::string::npos ? "" : subject.substr(begin, end - begin + 1);
}

std::string cased(std::string subject, int (*change)(int)) {
  std::transform(subject.begin(), subject.end(), subject.begin(),
                 [change](unsigned char c) { return static_cast<char>(change(c)); });
  return subject;
}

Value string_method(const std::string& s, const std::string& name) {
  using Method = Value (*)(const std::string&, const Arguments&);
  static const std::map<std::string, Method> methods{
      {"lower", [](const std::string& t, const Arguments&) { return Value(cased(t, std::tolower)); }},
      {"upper", [](const std::string& t, const Arguments&) { return Value(cased(t, std::toupper)); }},
      {"strip", [](const std::string& t, const Arguments& a) { return Value(stripped(t, a, true, true)); }},
      {"lstrip", [](const std::string& t, const Arguments& a) { return Value(stripped(t, a, true, false)); }},
      {"rstrip", [](const std::string& t, const Arguments& a) { return Value(stripped(t, a, false, true)); }},
      {"split", split},
      {"join", joined},
      {"replace", [](const std::string& t, const Arguments& a) { return replaced(t, a); }},
      {"startswith", [](const std::string& t,
                        const Arguments& a) { return Value(t.starts_with(text(a, 0, "startswith"))); }},
      {"endswith",
       [](const std::string& t, const Arguments& a) { return Value(t.ends_with(text(a, 0, "endswith"))); }},
      {"find",
       [](const std::string& t, const Arguments& a) {
         const std::size_t at = t.find(text(a, 0, "find"));
         return Value(at == std::string::npos ? std::int64_t{-1} : static_cast<std::int64_t>(at));
       }},
  };
  if (name == "format") {
    return Value::function(name, [s](ValueList& a, KeywordArguments& k) { return formatted(s, a, k); });
  }
  if (const auto found = methods.find(name); found != methods.end()) {
    return Value::function(
        name, [s, method = found->second](ValueList& a, KeywordArguments&) { return method(s, a); });
  }
  std::vector<std::string> names{"format"};
  for (const auto& [known, method] : methods) names.push_back(known);
  throw ExpressionError(fmt::format("a string has no '{}'{}", name, did_you_mean(name, names)),
                        "xacro.attribute");
}

Value dict_method(const Value& dict, const std::string& name) {
  const auto list = [&dict](auto&& make) {
    return [dict, make](ValueList&, KeywordArguments&) {
      ValueList out;
      for (const auto& [key, value] : *dict.as<Value::Dict>().items) out.push_back(make(key, value));
      return Value::list(std::move(out));
    };
  };
  if (name == "keys") return Value::function(name, list([](const Value& k, const Value&) { return k; }));
  if (name == "values") return Value::function(name, list([](const Value&, const Value& v) { return v; }));
  if (name == "items")
    return Value::function(name, list([](const Value& k, const Value& v) { return Value::tuple({k, v}); }));
  if (name == "get") {
    return Value::function(name, [dict](ValueList& a, KeywordArguments&) {
      if (a.empty()) throw ExpressionError("get() needs a key");
      const Value* found = dict.get(a[0]);
      return found != nullptr ? *found : a.size() > 1 ? a[1] : Value();
    });
  }
  ValueList keys;
  dict.items(keys);
  std::vector<std::string> names;
  for (const Value& key : keys) names.push_back(key.str());
  throw ExpressionError(fmt::format("there is no '{}'{}", name, did_you_mean(name, names)),
                        "xacro.attribute");
}

}  // namespace

std::optional<Value> find_builtin(const std::string& name) {
  const auto found = builtins().find(name);
  if (found == builtins().end()) return std::nullopt;
  return found->second;
}

std::vector<std::string> builtin_names() {
  std::vector<std::string> out;
  for (const auto& [name, value] : builtins()) out.push_back(name);
  return out;
}

Value get_attribute(const Value& object, const std::string& name) {
  if (object.is<std::string>()) return string_method(object.as<std::string>(), name);
  if (object.is<Value::Dict>()) {
    if (const Value* entry = object.get(Value(name))) return *entry;
    return dict_method(object, name);
  }
  throw ExpressionError(fmt::format("'{}' ({}) has no '{}'", object.str(), object.type_name(), name),
                        "xacro.attribute");
}

}  // namespace doppel
