// Python's built-in functions, as far as xacro exposes them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/description/xacro/detail/expression_functions.h"
#include "doppel/description/xacro/detail/expression_operators.h"

namespace doppel {
namespace {

constexpr std::int64_t kMaxRangeLength = 200'000;

Value extreme(ValueList& a, const KeywordArguments& keywords, const char* function, Operator better) {
  if (a.empty()) throw ExpressionError(fmt::format("{}() needs arguments", function));
  const ValueList made = a.size() == 1 && !a[0].sequence() ? items_argument(a, 0, function) : ValueList();
  const ValueList& items = a.size() > 1 ? a : a[0].sequence() ? a[0].values() : made;
  const Value* key = nullptr;
  const Value* fallback = nullptr;
  for (const auto& [name, value] : keywords) (name == "key" ? key : fallback) = &value;
  if (items.empty() && fallback != nullptr) return *fallback;
  if (items.empty()) throw ExpressionError(fmt::format("{}() of an empty sequence", function));
  std::size_t best = 0;
  Value measured = key == nullptr ? Value() : call_value(*key, {items[0]});
  for (std::size_t i = 1; i < items.size(); ++i) {
    if (key == nullptr) {
      if (compare_values(better, items[i], items[best])) best = i;
      continue;
    }
    Value other = call_value(*key, {items[i]});
    if (!compare_values(better, other, measured)) continue;
    best = i;
    measured = std::move(other);
  }
  return items[best];
}

Value to_int(const Arguments& a) {
  expect_arguments(a, 0, 2, "int");
  if (a.empty()) return Value(std::int64_t{0});
  if (a[0].is<std::string>()) {
    const std::string& text = a[0].as<std::string>();
    const std::int64_t base = a.size() > 1 ? integer_argument(a, 1, "int") : 10;
    if (base < 0 || base == 1 || base > 36)
      throw ExpressionError(fmt::format("int() does not support base {}", base), "xacro.value");
    if (auto out = parse_whole(text, static_cast<int>(base))) return *std::move(out);
    throw ExpressionError(fmt::format("int() cannot convert {}", a[0].brief()), "xacro.value");
  }
  if (a[0].is<Value::Big>()) return a[0];
  const double value = real_argument(a, 0, "int");
  return a[0].integral() ? Value(a[0].integer()) : to_integer(std::trunc(value), "int");
}

Value to_float(const Arguments& a) {
  expect_arguments(a, 0, 1, "float");
  if (a.empty()) return Value(0.0);
  if (!a[0].is<std::string>()) return Value(real_argument(a, 0, "float"));
  double out = 0;
  if (!parse_real(a[0].as<std::string>(), out))
    throw ExpressionError(fmt::format("float() cannot convert {}", a[0].brief()), "xacro.value");
  return Value(out);
}

// To even at halves; with digits, by the exact decimal value, as CPython does.
Value round_to(const Arguments& a) {
  expect_arguments(a, 1, 2, "round");
  if (a[0].is<Value::Big>() && (a.size() < 2 || !a[1].integral() || a[1].integer() >= 0)) return a[0];
  const double value = real_argument(a, 0, "round");
  if (a.size() < 2 || a[1].is<Value::None>())
    return a[0].integral() ? Value(a[0].integer()) : to_integer(std::nearbyint(value), "round");
  const std::int64_t digits = integer_argument(a, 1, "round");
  if (a[0].integral() && digits >= 0) return Value(a[0].integer());
  if (digits > 322 || !std::isfinite(value)) return Value(value);
  if (digits < 0) {
    const double unit = std::pow(10.0, static_cast<double>(-std::max<std::int64_t>(digits, -400)));
    const double rounded = std::isinf(unit) ? 0.0 : std::nearbyint(value / unit) * unit;
    return a[0].integral() ? to_integer(rounded, "round") : Value(rounded);
  }
  double out = 0;
  parse_real(fmt::format("{:.{}f}", value, digits), out);
  return Value(out);
}

Value range(const Arguments& a) {
  expect_arguments(a, 1, 3, "range");
  const std::int64_t from = a.size() < 2 ? 0 : integer_argument(a, 0, "range");
  const std::int64_t to = integer_argument(a, a.size() < 2 ? 0 : 1, "range");
  const std::int64_t step = a.size() < 3 ? 1 : integer_argument(a, 2, "range");
  if (step == 0) throw ExpressionError("range() with a step of zero");
  const double count = (static_cast<double>(to) - static_cast<double>(from)) / static_cast<double>(step);
  if (count > static_cast<double>(kMaxRangeLength))
    throw ExpressionError("range() is too long", "xacro.too_much");
  ValueList out;
  std::int64_t at = from;
  while (static_cast<double>(out.size()) < count) {
    out.emplace_back(at);
    if (__builtin_add_overflow(at, step, &at)) break;
  }
  return Value::list(std::move(out), step == 1 ? fmt::format("range({}, {})", from, to)
                                               : fmt::format("range({}, {}, {})", from, to, step));
}

Value make_dict(const Arguments& a, const KeywordArguments& keywords) {
  expect_arguments(a, 0, 1, "dict");
  ValueDict out;
  if (!a.empty() && a[0].is<Value::Dict>()) {
    for (const auto& [key, value] : a[0].as<Value::Dict>().entries->dict) out.set(key, value);
  } else if (!a.empty()) {
    for (const Value& entry : items_argument(a, 0, "dict")) {
      ValueList pair;
      if (!entry.items(pair) || pair.size() != 2) throw ExpressionError("dict() needs pairs");
      out.set(pair[0], pair[1]);
    }
  }
  for (const auto& [name, value] : keywords) out.set(Value(name), value);
  return Value::dict(std::move(out));
}

Value zip(const Arguments& a) {
  ValueList out;
  std::vector<ValueList> lists;
  for (std::size_t i = 0; i < a.size(); ++i) lists.push_back(items_argument(a, i, "zip"));
  for (std::size_t row = 0; !lists.empty(); ++row) {
    ValueList tuple;
    for (const ValueList& list : lists) {
      if (row >= list.size()) return Value::list(std::move(out), "<zip object>");
      tuple.push_back(list[row]);
    }
    out.push_back(Value::tuple(std::move(tuple)));
  }
  return Value::list(std::move(out), "<zip object>");
}

Value map(const Arguments& a) {
  if (a.size() < 2) throw ExpressionError("map() needs a function and items");
  std::vector<ValueList> lists;
  std::size_t rows = SIZE_MAX;
  for (std::size_t i = 1; i < a.size(); ++i) {
    lists.push_back(items_argument(a, i, "map"));
    rows = std::min(rows, lists.back().size());
  }
  ValueList out;
  for (std::size_t row = 0; row < rows; ++row) {
    ValueList arguments;
    for (const ValueList& list : lists) arguments.push_back(list[row]);
    out.push_back(call_value(a[0], std::move(arguments)));
  }
  return Value::list(std::move(out), "<map object>");
}

Value filter(const Arguments& a) {
  expect_arguments(a, 2, 2, "filter");
  ValueList out;
  for (const Value& item : items_argument(a, 1, "filter")) {
    if (a[0].is<Value::None>() ? item.truth() : call_value(a[0], {item}).truth()) out.push_back(item);
  }
  return Value::list(std::move(out), "<filter object>");
}

Value sum(const Arguments& a) {
  expect_arguments(a, 1, 2, "sum");
  Value total = a.size() > 1 ? a[1] : Value(std::int64_t{0});
  if (total.is<std::string>()) throw ExpressionError("sum() does not take strings; use ''.join()");
  for (const Value& item : items_argument(a, 0, "sum")) total = binary_operation(Operator::add, total, item);
  return total;
}

Value is_instance(const Arguments& a) {
  expect_arguments(a, 2, 2, "isinstance");
  const ValueList types = a[1].is<Value::Tuple>() ? a[1].values() : ValueList{a[1]};
  for (const Value& type : types) {
    if (!type.is<Value::Function>() || !type.as<Value::Function>().type)
      throw ExpressionError(fmt::format("isinstance() needs a type, not {}", type.brief()));
    const std::string& name = type.as<Value::Function>().name;
    if (name == a[0].type_name() || (name == "int" && a[0].is<bool>())) return Value(true);
  }
  return Value(false);
}

Value length(const Arguments& a) {
  expect_arguments(a, 1, 1, "len");
  if (a[0].is<std::string>())
    return Value(static_cast<std::int64_t>(count_characters(a[0].as<std::string>())));
  if (a[0].sequence()) return Value(static_cast<std::int64_t>(a[0].values().size()));
  return Value(static_cast<std::int64_t>(items_argument(a, 0, "len").size()));
}

void add_type(FunctionTable& t, const char* name, std::function<Value(const Arguments&)> f) {
  t[name] = Value::function(
      name, [f = std::move(f)](ValueList& a, KeywordArguments&) { return f(a); }, true);
}

// The built-ins that are names of their own.
FunctionTable global_functions() {
  FunctionTable t;
  add_type(t, "int", to_int);
  add_type(t, "float", to_float);
  add_type(t, "str", [](const Arguments& a) { return Value(a.empty() ? std::string() : a[0].str()); });
  add_type(t, "list", [](const Arguments& a) {
    return Value::list(a.empty() ? ValueList{} : items_argument(a, 0, "list"));
  });
  t["dict"] = Value::function(
      "dict", [](ValueList& a, KeywordArguments& k) { return make_dict(a, k); }, true);
  t["min"] = Value::function(
      "min", [](ValueList& a, KeywordArguments& k) { return extreme(a, k, "min", Operator::less); });
  t["max"] = Value::function(
      "max", [](ValueList& a, KeywordArguments& k) { return extreme(a, k, "max", Operator::greater); });
  add_function(t, "map", map);
  add_function(t, "len", length);
  add_function(t, "round", round_to);
  add_function(t, "range", range);
  t["sorted"] = Value::function("sorted", [](ValueList& a, KeywordArguments& k) {
    expect_arguments(a, 1, 1, "sorted");
    return sorted_values(items_argument(a, 0, "sorted"), k);
  });
  return t;
}

void add_python_sequences(FunctionTable& t) {
  add_type(t, "tuple", [](const Arguments& a) {
    return Value::tuple(a.empty() ? ValueList{} : items_argument(a, 0, "tuple"));
  });
  add_type(t, "set", [](const Arguments& a) {
    return Value::set(a.empty() ? ValueList{} : items_argument(a, 0, "set"));
  });
  t["frozenset"] = t["set"];
  add_function(t, "sum", sum);
  add_function(t, "zip", zip);
  add_function(t, "filter", filter);
  add_function(t, "any", [](const Arguments& a) {
    const ValueList items = items_argument(a, 0, "any");
    return Value(std::any_of(items.begin(), items.end(), [](const Value& v) { return v.truth(); }));
  });
  add_function(t, "all", [](const Arguments& a) {
    const ValueList items = items_argument(a, 0, "all");
    return Value(std::all_of(items.begin(), items.end(), [](const Value& v) { return v.truth(); }));
  });
  t["enumerate"] = Value::function("enumerate", [](ValueList& a, KeywordArguments& k) {
    ValueList out;
    std::int64_t i = a.size() > 1 ? integer_argument(a, 1, "enumerate") : 0;
    for (const auto& [name, value] : k) i = integer_argument({value}, 0, "enumerate");
    for (const Value& item : items_argument(a, 0, "enumerate"))
      out.push_back(Value::tuple({Value(i++), item}));
    return Value::list(std::move(out), "<enumerate object>");
  });
  add_function(t, "reversed", [](const Arguments& a) {
    ValueList items = items_argument(a, 0, "reversed");
    std::reverse(items.begin(), items.end());
    return Value::list(std::move(items), "<reversed object>");
  });
}

// Those that are in `python` only.
FunctionTable python_functions(const FunctionTable& globals) {
  FunctionTable t = globals;
  add_python_sequences(t);
  add_type(t, "bool", [](const Arguments& a) { return Value(!a.empty() && a[0].truth()); });
  add_function(t, "isinstance", is_instance);
  add_function(t, "repr", [](const Arguments& a) {
    expect_arguments(a, 1, 1, "repr");
    return Value(a[0].repr());
  });
  add_function(t, "abs", [](const Arguments& a) {
    if (!a.empty() && a[0].is<Value::Big>())
      return a[0].as<Value::Big>().number->negative() ? unary_operation(Operator::subtract, a[0]) : a[0];
    const double value = real_argument(a, 0, "abs");
    if (!a[0].integral()) return Value(std::abs(value));
    return a[0].integer() < 0 ? unary_operation(Operator::subtract, a[0]) : Value(a[0].integer());
  });
  add_function(t, "divmod", [](const Arguments& a) {
    expect_arguments(a, 2, 2, "divmod");
    return Value::tuple({binary_operation(Operator::floor_divide, a[0], a[1]),
                         binary_operation(Operator::modulo, a[0], a[1])});
  });
  add_function(t, "ord", [](const Arguments& a) {
    const std::string& text = text_argument(a, 0, "ord");
    if (count_characters(text) != 1) throw ExpressionError("ord() needs one character");
    const auto first = static_cast<unsigned char>(text[0]);
    std::int64_t code = text.size() == 1 ? first : first & (0x7F >> text.size());
    for (std::size_t i = 1; i < text.size(); ++i)
      code = code << 6 | (static_cast<unsigned char>(text[i]) & 0x3F);
    return Value(code);
  });
  const FunctionTable types = t;
  add_function(t, "type", [types](const Arguments& a) {
    expect_arguments(a, 1, 1, "type");
    const auto found = types.find(a[0].type_name());
    if (found == types.end()) throw ExpressionError(fmt::format("type() of a {}", a[0].type_name()));
    return found->second;
  });
  return t;
}

const FunctionTable& builtins() {
  static const FunctionTable table = [] {
    FunctionTable t = global_functions();
    FunctionTable math = math_functions();
    t["python"] = Value::object("python", std::make_shared<Module>(python_functions(t)));
    t.insert(math.begin(), math.end());
    t["math"] = Value::object("math", std::make_shared<Module>(std::move(math)));
    return t;
  }();
  return table;
}

// A hash table, because every name of every expression is looked up once.
class BuiltinIndex {
 public:
  explicit BuiltinIndex(const FunctionTable& table) {
    for (const auto& [name, value] : table) {
      std::size_t at = place(name);
      while (slots_[at].value != nullptr) at = (at + 1) % slots_.size();
      slots_[at] = {name, &value};
    }
  }
  [[nodiscard]] const Value* find(std::string_view name) const {
    for (std::size_t at = place(name); slots_[at].value != nullptr; at = (at + 1) % slots_.size()) {
      if (slots_[at].name == name) return slots_[at].value;
    }
    return nullptr;
  }

 private:
  struct Slot {
    std::string_view name;
    const Value* value = nullptr;
  };
  static std::size_t place(std::string_view name) {
    std::size_t out = name.size();
    for (const char c : name.substr(0, 8)) out = out * 33 + static_cast<unsigned char>(c);
    return out % std::tuple_size_v<decltype(slots_)>;
  }
  std::array<Slot, 512> slots_{};  // several times the number of names
};

}  // namespace

double real_argument(const Arguments& a, std::size_t i, const char* function) {
  if (i >= a.size()) throw ExpressionError(fmt::format("{}() needs more arguments", function));
  if (!a[i].number())
    throw ExpressionError(
        fmt::format("{}() needs a number, not {} ({})", function, a[i].brief(), a[i].type_name()));
  return a[i].real();
}

std::int64_t integer_argument(const Arguments& a, std::size_t i, const char* function) {
  if (i >= a.size()) throw ExpressionError(fmt::format("{}() needs more arguments", function));
  if (!a[i].integral())
    throw ExpressionError(
        fmt::format("{}() needs an integer, not {} ({})", function, a[i].brief(), a[i].type_name()));
  return a[i].integer();
}

const std::string& text_argument(const Arguments& a, std::size_t i, const char* function) {
  if (i >= a.size() || !a[i].is<std::string>())
    throw ExpressionError(fmt::format("{}() needs a string", function));
  return a[i].as<std::string>();
}

ValueList items_argument(const Arguments& a, std::size_t i, const char* function) {
  if (i >= a.size()) throw ExpressionError(fmt::format("{}() needs more arguments", function));
  return items_of(a[i]);
}

void expect_arguments(const Arguments& a, std::size_t least, std::size_t most, const char* function) {
  if (a.size() >= least && a.size() <= most) return;
  throw ExpressionError(
      fmt::format("{}() takes {} arguments, not {}", function,
                  least == most ? std::to_string(least) : fmt::format("{} to {}", least, most), a.size()));
}

void add_function(FunctionTable& table, const char* name, std::function<Value(const Arguments&)> f) {
  table[name] = Value::function(name, [f = std::move(f), name](ValueList& a, KeywordArguments& k) {
    if (!k.empty()) throw ExpressionError(fmt::format("{}() takes no argument '{}'", name, k[0].first));
    return f(a);
  });
}

Value call_value(const Value& function, ValueList arguments) {
  if (!function.is<Value::Function>())
    throw ExpressionError(fmt::format("{} ({}) cannot be called", function.brief(), function.type_name()));
  KeywordArguments none;
  return (*function.as<Value::Function>().call)(arguments, none);
}

Value to_integer(double value, const char* function) {
  if (std::abs(value) < 9.2e18) return Value(static_cast<std::int64_t>(value));
  if (!std::isfinite(value))
    throw ExpressionError(fmt::format("{}() of {}, which is not an integer", function, format_real(value)),
                          "xacro.overflow");
  return Value::whole(WholeNumber(value));
}

Value sorted_values(ValueList items, const KeywordArguments& keywords) {
  bool reverse = false;
  const Value* key = nullptr;
  for (const auto& [name, value] : keywords) {
    if (name == "reverse")
      reverse = value.truth();
    else if (name == "key")
      key = value.is<Value::None>() ? nullptr : &value;
    else
      throw ExpressionError(fmt::format("sorted() takes no argument '{}'", name));
  }
  std::vector<std::pair<Value, Value>> keyed;
  for (Value& item : items) {
    Value measured = key == nullptr ? item : call_value(*key, {item});
    if (measured.is<double>() && std::isnan(measured.real()))
      throw ExpressionError("sorted() of something that is not a number");
    keyed.emplace_back(std::move(measured), std::move(item));
  }
  std::stable_sort(keyed.begin(), keyed.end(), [reverse](const auto& l, const auto& r) {
    return reverse ? value_less(r.first, l.first) : value_less(l.first, r.first);
  });
  ValueList out;
  for (auto& [measured, item] : keyed) out.push_back(std::move(item));
  return Value::list(std::move(out));
}

const Value* find_builtin(std::string_view name) {
  static const BuiltinIndex index(builtins());
  return index.find(name);
}

std::vector<std::string> builtin_names() {
  std::vector<std::string> out;
  for (const auto& [name, value] : builtins()) out.push_back(name);
  return out;
}

}  // namespace doppel
