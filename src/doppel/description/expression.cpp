#include "doppel/description/expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <list>
#include <unordered_map>

#include "doppel/core/names.h"
#include "doppel/description/expression_parser.h"

namespace doppel {
namespace {

constexpr std::size_t kLongest = 1'000'000;  // items or characters that one operation may make

[[noreturn]] void unsupported(const std::string& op, const Value& a, const Value& b) {
  throw ExpressionError(fmt::format("unsupported operand types for {}: '{}' ({}) and '{}' ({})", op, a.str(),
                                    a.type_name(), b.str(), b.type_name()));
}

std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
  const std::int64_t q = a / b;
  return (a % b != 0 && (a < 0) != (b < 0)) ? q - 1 : q;
}

Value power(const Value& a, const Value& b) {
  if (a.integral() && b.integral() && b.integer() >= 0) {
    std::int64_t result = 1;
    bool fits = true;
    for (std::int64_t i = 0; i < b.integer() && fits && i < 64; ++i)
      fits = !__builtin_mul_overflow(result, a.integer(), &result);
    if (fits && b.integer() < 64) return Value(result);
  }
  return Value(std::pow(a.real(), b.real()));
}

Value arithmetic(const std::string& op, const Value& a, const Value& b) {
  if (op == "**") return power(a, b);
  if (op == "/") {
    if (b.real() == 0.0) throw ExpressionError("division by zero");
    return Value(a.real() / b.real());
  }
  if ((op == "//" || op == "%") && b.real() == 0.0) throw ExpressionError("division by zero");
  if (a.integral() && b.integral()) {
    const std::int64_t x = a.integer(), y = b.integer();
    std::int64_t out = 0;
    if (op == "+" && !__builtin_add_overflow(x, y, &out)) return Value(out);
    if (op == "-" && !__builtin_sub_overflow(x, y, &out)) return Value(out);
    if (op == "*" && !__builtin_mul_overflow(x, y, &out)) return Value(out);
    if (op == "//" && y != -1) return Value(floor_divide(x, y));
    if (op == "%" && y != -1) return Value(x - floor_divide(x, y) * y);
    if (op == "%") return Value(std::int64_t{0});
    if (op == "&") return Value(x & y);
    if (op == "|") return Value(x | y);
    if (op == "^") return Value(x ^ y);
    if ((op == "<<" || op == ">>") && y >= 0 && y < 63)
      return Value(op == "<<" ? x * (std::int64_t{1} << y) : x >> y);
  }
  const double x = a.real(), y = b.real();
  if (op == "+") return Value(x + y);
  if (op == "-") return Value(x - y);
  if (op == "*") return Value(x * y);
  if (op == "//") return Value(std::floor(x / y));
  if (op == "%") return Value(x - std::floor(x / y) * y);
  unsupported(op, a, b);
}

void check_length(std::size_t length) {
  if (length > kLongest) throw ExpressionError("the result is too long");
}

Value repeated(const Value& what, std::int64_t times) {
  const auto n = static_cast<std::size_t>(std::max<std::int64_t>(0, times));
  if (what.is<std::string>()) {
    check_length(what.as<std::string>().size() * std::min(n, kLongest + 1));
    std::string out;
    for (std::size_t i = 0; i < n; ++i) out += what.as<std::string>();
    return Value(out);
  }
  ValueList items, out;
  what.items(items);
  check_length(items.size() * std::min(n, kLongest + 1));
  for (std::size_t i = 0; i < n; ++i) out.insert(out.end(), items.begin(), items.end());
  return what.is<Value::List>() ? Value::list(std::move(out)) : Value::tuple(std::move(out));
}

Value formatted(const std::string& format, const Value& value);

Value binary(const std::string& op, const Value& a, const Value& b) {
  if (a.number() && b.number()) return arithmetic(op, a, b);
  const bool sequence_a = a.is<std::string>() || a.is<Value::List>() || a.is<Value::Tuple>();
  const bool sequence_b = b.is<std::string>() || b.is<Value::List>() || b.is<Value::Tuple>();
  if (op == "+" && sequence_a && a.data.index() == b.data.index()) {
    if (a.is<std::string>()) {
      check_length(a.as<std::string>().size() + b.as<std::string>().size());
      return Value(a.as<std::string>() + b.as<std::string>());
    }
    ValueList x, y;
    a.items(x);
    b.items(y);
    check_length(x.size() + y.size());
    x.insert(x.end(), y.begin(), y.end());
    return a.is<Value::List>() ? Value::list(std::move(x)) : Value::tuple(std::move(x));
  }
  if (op == "*" && sequence_a && b.integral()) return repeated(a, b.integer());
  if (op == "*" && sequence_b && a.integral()) return repeated(b, a.integer());
  if (op == "%" && a.is<std::string>()) return formatted(a.as<std::string>(), b);
  unsupported(op, a, b);
}

// Python's "..." % values, for %s %d %i %f %g %e %% with flags, width and precision.
Value formatted(const std::string& format, const Value& value) {
  ValueList arguments{value};
  if (value.is<Value::Tuple>()) value.items(arguments);
  std::string out;
  std::size_t used = 0;
  for (std::size_t i = 0; i < format.size(); ++i) {
    if (format[i] != '%') {
      out += format[i];
      continue;
    }
    const std::size_t end = format.find_first_of("sdifgeFGEr%", i + 1);
    if (end == std::string::npos) throw ExpressionError("incomplete format '" + format + "'");
    const char kind = format[end];
    const std::string flags = format.substr(i + 1, end - i - 1);
    i = end;
    if (kind == '%') {
      out += '%';
      continue;
    }
    if (used >= arguments.size())
      throw ExpressionError("not enough arguments for the format '" + format + "'");
    const Value& argument = arguments[used++];
    if (flags.find_first_not_of("0123456789.+- #") != std::string::npos || flags.size() > 8)
      throw ExpressionError("unknown format '" + format + "'");
    char buffer[512];
    if (kind == 's' || kind == 'r') {
      std::snprintf(buffer, sizeof buffer, ("%" + flags + "s").c_str(),
                    (kind == 's' ? argument.str() : argument.repr()).c_str());
    } else if (!argument.number()) {
      throw ExpressionError(fmt::format("%{} needs a number, not '{}'", kind, argument.str()));
    } else if (kind == 'd' || kind == 'i') {
      std::snprintf(buffer, sizeof buffer, ("%" + flags + "lld").c_str(),
                    static_cast<long long>(argument.real()));
    } else {
      std::snprintf(buffer, sizeof buffer, ("%" + flags + kind).c_str(), argument.real());
    }
    out += buffer;
  }
  return Value(out);
}

bool less(const Value& a, const Value& b, const std::string& op) {
  if (a.number() && b.number()) return a.real() < b.real();
  if (a.is<std::string>() && b.is<std::string>()) return a.as<std::string>() < b.as<std::string>();
  ValueList x, y;
  const bool lists = (a.is<Value::List>() || a.is<Value::Tuple>()) && a.data.index() == b.data.index();
  if (!lists || !a.items(x) || !b.items(y)) unsupported(op, a, b);
  return std::lexicographical_compare(x.begin(), x.end(), y.begin(), y.end(),
                                      [&op](const Value& l, const Value& r) { return less(l, r, op); });
}

bool contains(const Value& container, const Value& item) {
  if (container.is<std::string>()) {
    if (!item.is<std::string>()) unsupported("in", item, container);
    return container.as<std::string>().find(item.as<std::string>()) != std::string::npos;
  }
  ValueList items;
  if (!container.items(items)) unsupported("in", item, container);
  return std::any_of(items.begin(), items.end(), [&item](const Value& v) { return equal(v, item); });
}

bool compare(const std::string& op, const Value& a, const Value& b) {
  if (op == "==") return equal(a, b);
  if (op == "!=") return !equal(a, b);
  if (op == "is" || op == "is not") return (a.data.index() == b.data.index() && equal(a, b)) == (op == "is");
  if (op == "in" || op == "not in") return contains(b, a) == (op == "in");
  if (op == "<") return less(a, b, op);
  if (op == ">") return less(b, a, op);
  if (op == "<=") return !less(b, a, op);
  return !less(a, b, op);
}

// A comprehension's names in front of the scope around it.
class LoopScope : public NameScope {
 public:
  explicit LoopScope(NameScope& outer) : outer_(outer) {}
  std::optional<Value> find(const std::string& name) override {
    for (const auto& [n, value] : names_) {
      if (n == name) return value;
    }
    return outer_.find(name);
  }
  [[nodiscard]] std::vector<std::string> names() const override { return outer_.names(); }
  void bind(const std::vector<std::string>& names, const Value& value) {
    names_.clear();
    if (names.size() == 1) {
      names_.emplace_back(names[0], value);
      return;
    }
    ValueList parts;
    if (!value.items(parts) || parts.size() != names.size()) {
      throw ExpressionError(
          fmt::format("'{}' cannot be taken apart into {} names", value.str(), names.size()));
    }
    for (std::size_t i = 0; i < names.size(); ++i) names_.emplace_back(names[i], parts[i]);
  }

 private:
  NameScope& outer_;
  std::vector<std::pair<std::string, Value>> names_;
};

class Evaluator {
 public:
  Evaluator(NameScope& scope, std::int64_t& budget) : scope_(scope), budget_(budget) {}

  Value value(const Expression& e) {
    if (--budget_ < 0) throw ExpressionError("the evaluation takes too many steps", "xacro.too_much");
    using Kind = Expression::Kind;
    switch (e.kind) {
      case Kind::constant:
        return e.value;
      case Kind::name:
        return name(e.text);
      case Kind::list:
        return Value::list(values(e.parts));
      case Kind::tuple:
        return Value::tuple(values(e.parts));
      case Kind::dict:
        return dict(e);
      case Kind::unary:
        return unary(e);
      case Kind::binary: {
        const Value left = value(e.parts[0]);
        return binary(e.text, left, value(e.parts[1]));
      }
      case Kind::compare:
        return comparison(e);
      case Kind::logic_and: {
        const Value left = value(e.parts[0]);
        return left.truth() ? value(e.parts[1]) : left;
      }
      case Kind::logic_or: {
        const Value left = value(e.parts[0]);
        return left.truth() ? left : value(e.parts[1]);
      }
      case Kind::logic_not:
        return Value(!value(e.parts[0]).truth());
      case Kind::ternary:
        return value(e.parts[0]).truth() ? value(e.parts[1]) : value(e.parts[2]);
      case Kind::index: {
        const Value object = value(e.parts[0]);
        return index(object, value(e.parts[1]));
      }
      case Kind::slice:
        return slice(e);
      case Kind::attribute:
        return get_attribute(value(e.parts[0]), e.text);
      case Kind::call:
        return call(e);
      case Kind::comprehension:
        return comprehension(e);
    }
    return {};
  }

 private:
  ValueList values(const std::vector<Expression>& parts) {
    ValueList out;
    for (const Expression& part : parts) out.push_back(value(part));
    return out;
  }

  Value name(const std::string& text) {
    if (auto known = scope_.find(text)) return *known;
    if (auto builtin = find_builtin(text)) return *builtin;
    std::vector<std::string> names = scope_.names();
    const auto builtins = builtin_names();
    names.insert(names.end(), builtins.begin(), builtins.end());
    throw ExpressionError(fmt::format("name '{}' is not defined{}", text, did_you_mean(text, names)),
                          "xacro.undefined_name");
  }

  Value dict(const Expression& e) {
    ValueDict out;
    for (std::size_t i = 0; i + 1 < e.parts.size(); i += 2) {
      const Value key = value(e.parts[i]);
      out.emplace_back(key, value(e.parts[i + 1]));
    }
    return Value::dict(std::move(out));
  }

  Value unary(const Expression& e) {
    const Value operand = value(e.parts[0]);
    if (!operand.number())
      throw ExpressionError(fmt::format("'{}' ({}) has no {}", operand.str(), operand.type_name(), e.text));
    if (operand.is<double>()) return Value(e.text == "-" ? -operand.real() : operand.real());
    const std::int64_t whole = operand.integer();
    if (e.text == "~") return Value(~whole);
    return Value(e.text == "-" && whole != INT64_MIN ? -whole : whole);
  }

  Value comparison(const Expression& e) {
    Value left = value(e.parts[0]);
    for (std::size_t i = 0; i < e.keywords.size(); ++i) {
      Value right = value(e.parts[i + 1]);
      if (!compare(e.keywords[i], left, right)) return Value(false);
      left = std::move(right);
    }
    return Value(true);
  }

  static Value index(const Value& object, const Value& key) {
    if (object.is<Value::Dict>()) {
      if (const Value* found = object.get(key)) return *found;
      ValueList keys;
      object.items(keys);
      std::vector<std::string> names;
      for (const Value& k : keys) names.push_back(k.str());
      throw ExpressionError(fmt::format("there is no key {}{}", key.repr(), did_you_mean(key.str(), names)),
                            "xacro.key");
    }
    ValueList items;
    if (!object.items(items))
      throw ExpressionError(fmt::format("'{}' ({}) has no items", object.str(), object.type_name()));
    if (!key.integral())
      throw ExpressionError(fmt::format("an index is a whole number, not '{}'", key.str()));
    const auto size = static_cast<std::int64_t>(items.size());
    const std::int64_t i = key.integer() < 0 ? key.integer() + size : key.integer();
    if (i < 0 || i >= size)
      throw ExpressionError(fmt::format("the index {} is outside of {} items", key.integer(), size));
    return items[static_cast<std::size_t>(i)];
  }

  Value slice(const Expression& e) {
    const Value object = value(e.parts[0]);
    ValueList items, out;
    if (!object.items(items) || object.is<Value::Dict>())
      throw ExpressionError(fmt::format("'{}' cannot be sliced", object.str()));
    const auto bound = [&](std::size_t part) -> std::optional<std::int64_t> {
      const Value v = value(e.parts[part]);
      if (v.is<Value::None>()) return std::nullopt;
      if (!v.integral()) throw ExpressionError("a slice is made of whole numbers");
      return v.integer();
    };
    const auto size = static_cast<std::int64_t>(items.size());
    const std::int64_t step = bound(3).value_or(1);
    if (step == 0) throw ExpressionError("a slice's step cannot be zero");
    const auto placed = [&](std::optional<std::int64_t> v, std::int64_t absent) {
      if (!v) return absent;
      const std::int64_t at = *v < 0 ? *v + size : *v;
      return std::clamp<std::int64_t>(at, step > 0 ? 0 : -1, step > 0 ? size : size - 1);
    };
    const std::int64_t from = placed(bound(1), step > 0 ? 0 : size - 1),
                       to = placed(bound(2), step > 0 ? size : -1);
    for (std::int64_t i = from; step > 0 ? i < to : i > to; i += step)
      out.push_back(items[static_cast<std::size_t>(i)]);
    if (object.is<Value::Tuple>()) return Value::tuple(std::move(out));
    if (object.is<Value::List>()) return Value::list(std::move(out));
    std::string text;
    for (const Value& c : out) text += c.as<std::string>();
    return Value(text);
  }

  Value call(const Expression& e) {
    const Value function = value(e.parts[0]);
    if (!function.is<Value::Function>())
      throw ExpressionError(fmt::format("'{}' ({}) cannot be called", function.str(), function.type_name()));
    ValueList arguments;
    KeywordArguments keywords;
    const std::size_t positional = e.parts.size() - 1 - e.keywords.size();
    for (std::size_t i = 0; i < positional; ++i) arguments.push_back(value(e.parts[i + 1]));
    for (std::size_t i = 0; i < e.keywords.size(); ++i)
      keywords.emplace_back(e.keywords[i], value(e.parts[positional + 1 + i]));
    return (*function.as<Value::Function>().call)(arguments, keywords);
  }

  Value comprehension(const Expression& e) {
    const std::size_t elements = e.text == "dict" ? 2 : 1;
    ValueList items;
    const Value iterable = value(e.parts[elements]);
    if (!iterable.items(items))
      throw ExpressionError(fmt::format("'{}' has no items to go through", iterable.str()));
    LoopScope loop(scope_);
    Evaluator inside(loop, budget_);
    ValueList out;
    ValueDict entries;
    for (const Value& item : items) {
      loop.bind(e.keywords, item);
      bool wanted = true;
      for (std::size_t c = elements + 1; c < e.parts.size() && wanted; ++c)
        wanted = inside.value(e.parts[c]).truth();
      if (!wanted) continue;
      const Value first = inside.value(e.parts[0]);
      if (elements == 2)
        entries.emplace_back(first, inside.value(e.parts[1]));
      else
        out.push_back(first);
    }
    return elements == 2 ? Value::dict(std::move(entries)) : Value::list(std::move(out));
  }

  NameScope& scope_;
  std::int64_t& budget_;
};

}  // namespace

Value evaluate(std::string_view text, NameScope& scope, std::int64_t& budget) {
  return Evaluator(scope, budget).value(parse_expression(text));
}

}  // namespace doppel
