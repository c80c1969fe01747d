#include "doppel/description/xacro/detail/expression_operators.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/base/core/names.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxLength = 1'000'000;  // items or characters in the result of one operation
constexpr std::int64_t kMaxBits = WholeNumber::kMaxBits;

[[noreturn]] void unsupported(Operator op, const Value& a, const Value& b) {
  throw ExpressionError(fmt::format("'{}' is not supported between {} ({}) and {} ({})", symbol(op),
                                    a.brief(), a.type_name(), b.brief(), b.type_name()));
}
[[noreturn]] void overflow(Operator op, const Value& a, const Value& b) {
  throw ExpressionError(fmt::format("{} {} {} needs too many bits; write one of them with a decimal point",
                                    a.brief(), symbol(op), b.brief()),
                        "xacro.overflow");
}
void check_length(std::size_t length) {
  if (length > kMaxLength) throw ExpressionError("the result is too long", "xacro.too_much");
}

std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
  const std::int64_t q = a / b;
  return (a % b != 0 && (a < 0) != (b < 0)) ? q - 1 : q;
}

// CPython's float_divmod: the remainder has the divisor's sign, and the quotient fits it exactly.
std::pair<double, double> divide_floor(double a, double b) {
  double remainder = std::fmod(a, b);
  double quotient = (a - remainder) / b;
  if (remainder != 0.0) {
    if ((b < 0) != (remainder < 0)) {
      remainder += b;
      quotient -= 1.0;
    }
  } else {
    remainder = std::copysign(0.0, b);
  }
  double whole = std::copysign(0.0, a / b);
  if (quotient != 0.0) {
    whole = std::floor(quotient);
    if (quotient - whole > 0.5) whole += 1.0;
  }
  return {whole, remainder};
}

// Precondition: b is not negative.
Value whole_power(const Value& a, const Value& b) {
  if (a.integral() && a.integer() >= -1 && a.integer() <= 1) {
    if (b.integer() == 0) return Value(std::int64_t{1});
    return Value(a.integer() == -1 && b.integer() % 2 == 0 ? std::int64_t{1} : a.integer());
  }
  const WholeNumber base = a.whole_number();
  if (b.integer() > kMaxBits ||
      (base.bits() - 1) * static_cast<std::size_t>(b.integer()) > WholeNumber::kMaxBits)
    overflow(Operator::power, a, b);
  WholeNumber result(std::int64_t{1});
  for (std::int64_t i = 0; i < b.integer(); ++i) result = result * base;
  return Value::whole(std::move(result));
}

Value power(const Value& a, const Value& b) {
  if (a.whole() && b.integral() && b.integer() >= 0) return whole_power(a, b);
  const double x = a.real(), y = b.real();
  if (x == 0.0 && y < 0) throw ExpressionError("0 cannot be raised to a negative power");
  if (x < 0 && std::isfinite(x) && std::isfinite(y) && y != std::floor(y))
    throw ExpressionError(fmt::format("{} ** {} is a complex number", a.brief(), b.brief()));
  const double result = std::pow(x, y);
  if (std::isinf(result) && std::isfinite(x) && std::isfinite(y))
    throw ExpressionError(fmt::format("{} ** {} is too large", a.brief(), b.brief()));
  return Value(result);
}

// Operations whose result exceeds 64 bits.
Value large_integers(Operator op, const Value& a, const Value& b) {
  const WholeNumber x = a.whole_number(), y = b.whole_number();
  switch (op) {
    case Operator::add:
      return Value::whole(x + y);
    case Operator::subtract:
      return Value::whole(x - y);
    case Operator::multiply:
      return Value::whole(x * y);
    case Operator::floor_divide:
      return Value::whole(WholeNumber::divide(x, y).first);
    case Operator::modulo:
      return Value::whole(WholeNumber::divide(x, y).second);
    case Operator::left_shift:
    case Operator::right_shift: {
      if (y.negative()) throw ExpressionError("negative shift count");
      if (!b.integral() || b.integer() > kMaxBits) overflow(op, a, b);
      const Value factor = whole_power(Value(std::int64_t{2}), b);
      return large_integers(op == Operator::left_shift ? Operator::multiply : Operator::floor_divide, a,
                            factor);
    }
    default:
      overflow(op, a, b);
  }
}

Value integers(Operator op, const Value& a, const Value& b) {
  const std::int64_t x = a.integer(), y = b.integer();
  std::int64_t out = 0;
  bool wraps = false;
  switch (op) {
    case Operator::add:
      wraps = __builtin_add_overflow(x, y, &out);
      break;
    case Operator::subtract:
      wraps = __builtin_sub_overflow(x, y, &out);
      break;
    case Operator::multiply:
      wraps = __builtin_mul_overflow(x, y, &out);
      break;
    case Operator::floor_divide:
      wraps = y == -1 && x == INT64_MIN;
      if (!wraps) out = floor_divide(x, y);
      break;
    case Operator::modulo:
      out = y == -1 ? 0 : x - floor_divide(x, y) * y;
      break;
    case Operator::left_shift:
    case Operator::right_shift:
      if (y < 0) throw ExpressionError("negative shift count");
      if (op == Operator::right_shift) return Value(x >> std::min<std::int64_t>(y, 63));
      wraps = x != 0 && (y > 62 || __builtin_mul_overflow(x, std::int64_t{1} << y, &out));
      break;
    case Operator::bit_and:
      return a.is<bool>() && b.is<bool>() ? Value((x & y) != 0) : Value(x & y);
    case Operator::bit_or:
      return a.is<bool>() && b.is<bool>() ? Value((x | y) != 0) : Value(x | y);
    case Operator::bit_xor:
      return a.is<bool>() && b.is<bool>() ? Value((x ^ y) != 0) : Value(x ^ y);
    default:
      unsupported(op, a, b);
  }
  return wraps ? large_integers(op, a, b) : Value(out);
}

Value reals(Operator op, const Value& a, const Value& b) {
  const double x = a.real(), y = b.real();
  switch (op) {
    case Operator::add:
      return Value(x + y);
    case Operator::subtract:
      return Value(x - y);
    case Operator::multiply:
      return Value(x * y);
    case Operator::floor_divide:
      return Value(divide_floor(x, y).first);
    case Operator::modulo:
      return Value(divide_floor(x, y).second);
    default:
      unsupported(op, a, b);
  }
}

// Whole numbers that no float represents exactly are divided as integers.
Value divided(const Value& a, const Value& b) {
  constexpr std::int64_t kExact = std::int64_t{1} << 53;
  const auto exact = [](const Value& v) {
    return v.is<double>() || (v.integral() && v.integer() <= kExact && v.integer() >= -kExact);
  };
  if (!a.whole() || !b.whole() || (exact(a) && exact(b))) return Value(a.real() / b.real());
  const double out = WholeNumber::quotient(a.whole_number(), b.whole_number());
  if (std::isinf(out)) overflow(Operator::divide, a, b);
  return Value(out);
}

Value numbers(Operator op, const Value& a, const Value& b) {
  if (op == Operator::power) return power(a, b);
  const bool divides = op == Operator::divide || op == Operator::floor_divide || op == Operator::modulo;
  if (divides && !b.truth())
    throw ExpressionError(fmt::format("division by zero: {} {} {}", a.brief(), symbol(op), b.brief()),
                          "xacro.division_by_zero");
  if (op == Operator::divide) return divided(a, b);
  if (a.integral() && b.integral()) return integers(op, a, b);
  return a.whole() && b.whole() ? large_integers(op, a, b) : reals(op, a, b);
}

Value repeated(const Value& what, std::int64_t times) {
  const auto n = static_cast<std::size_t>(std::clamp<std::int64_t>(times, 0, INT64_C(1) << 40));
  if (what.is<std::string>()) {
    const std::string& text = what.as<std::string>();
    if (n > 0) check_length(text.size() > kMaxLength / n ? kMaxLength + 1 : text.size() * n);
    std::string out;
    if (text.empty()) return Value(out);
    out.reserve(text.size() * n);
    for (std::size_t i = 0; i < n; ++i) out += text;
    return Value(std::move(out));
  }
  const ValueList& items = what.values();
  if (n > 0) check_length(items.size() > kMaxLength / n ? kMaxLength + 1 : items.size() * n);
  ValueList out;
  if (!items.empty()) {
    for (std::size_t i = 0; i < n; ++i) out.insert(out.end(), items.begin(), items.end());
  }
  return what.is<Value::List>() ? Value::list(std::move(out)) : Value::tuple(std::move(out));
}

Value concatenated(const Value& a, const Value& b) {
  if (a.is<std::string>()) {
    check_length(a.as<std::string>().size() + b.as<std::string>().size());
    return Value(a.as<std::string>() + b.as<std::string>());
  }
  check_length(a.values().size() + b.values().size());
  ValueList out = a.values();
  out.insert(out.end(), b.values().begin(), b.values().end());
  return a.is<Value::List>() ? Value::list(std::move(out)) : Value::tuple(std::move(out));
}

Value sets(Operator op, const Value& a, const Value& b) {
  const ValueDict &x = a.as<Value::Set>().entries->dict, &y = b.as<Value::Set>().entries->dict;
  ValueList out;
  for (const auto& [key, value] : x) {
    const bool both = y.find(key) != nullptr;
    if (op == Operator::bit_or || (both == (op == Operator::bit_and))) out.push_back(key);
  }
  if (op == Operator::bit_or || op == Operator::bit_xor) {
    for (const auto& [key, value] : y) {
      if (x.find(key) == nullptr) out.push_back(key);
    }
  }
  return Value::set(out);
}

bool contains(const Value& container, const Value& item) {
  if (container.is<std::string>()) {
    if (!item.is<std::string>()) unsupported(Operator::in, item, container);
    return container.as<std::string>().find(item.as<std::string>()) != std::string::npos;
  }
  if (container.is<Value::Dict>()) return container.as<Value::Dict>().entries->dict.find(item) != nullptr;
  if (container.is<Value::Set>()) return container.as<Value::Set>().entries->dict.find(item) != nullptr;
  if (container.is<Value::Object>() && item.is<std::string>())
    return container.as<Value::Object>().object->find(item.as<std::string>()) != nullptr;
  if (!container.sequence()) unsupported(Operator::in, item, container);
  return std::any_of(container.values().begin(), container.values().end(),
                     [&item](const Value& v) { return equal(v, item); });
}

// <, <=, >, >= by `order`: -1, 0, 1; 2: a NaN, all are false.
int order(Operator op, const Value& a, const Value& b) {
  if (a.number() && b.number()) return compare_numbers(a, b);
  if (a.is<std::string>() && b.is<std::string>()) {
    const int order = a.as<std::string>().compare(b.as<std::string>());
    return order < 0 ? -1 : order > 0;
  }
  if (!a.sequence() || a.data.index() != b.data.index()) unsupported(op, a, b);
  const ValueList &x = a.values(), &y = b.values();
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
    if (!equal(x[i], y[i])) return order(op, x[i], y[i]);
  }
  return x.size() < y.size() ? -1 : x.size() > y.size();
}

bool subset(const Value& a, const Value& b) {
  const ValueDict& y = b.as<Value::Set>().entries->dict;
  const ValueDict& x = a.as<Value::Set>().entries->dict;
  return std::all_of(x.begin(), x.end(), [&y](const auto& entry) { return y.find(entry.first) != nullptr; });
}

bool ordered(Operator op, const Value& a, const Value& b) {
  if (a.is<Value::Set>() && b.is<Value::Set>()) {
    const bool down = op == Operator::less || op == Operator::less_equal;
    const bool strict = op == Operator::less || op == Operator::greater;
    return (down ? subset(a, b) : subset(b, a)) && !(strict && equal(a, b));
  }
  const int found = order(op, a, b);
  switch (op) {
    case Operator::less:
      return found == -1;
    case Operator::less_equal:
      return found == -1 || found == 0;
    case Operator::greater:
      return found == 1;
    default:
      return found == 1 || found == 0;
  }
}

bool identical(const Value& a, const Value& b) {
  if (a.data.index() != b.data.index()) return false;
  if (a.is<Value::List>()) return a.as<Value::List>().items == b.as<Value::List>().items;
  if (a.is<Value::Dict>()) return a.as<Value::Dict>().entries == b.as<Value::Dict>().entries;
  return equal(a, b);
}

std::size_t position(const Value& key, std::size_t size, const char* what) {
  if (!key.integral())
    throw ExpressionError(fmt::format("an index of a {} must be an integer, not {}", what, key.brief()));
  const auto count = static_cast<std::int64_t>(size);
  const std::int64_t i = key.integer() < 0 ? key.integer() + count : key.integer();
  if (i < 0 || i >= count)
    throw ExpressionError(fmt::format("the index {} is out of range for {} items", key.integer(), count),
                          "xacro.index");
  return static_cast<std::size_t>(i);
}

}  // namespace

Value unary_operation(Operator op, const Value& operand) {
  if (!operand.number() || (op == Operator::invert && !operand.whole()))
    throw ExpressionError(
        fmt::format("'{}' is not supported for {} ({})", symbol(op), operand.brief(), operand.type_name()));
  if (operand.is<double>()) return Value(op == Operator::subtract ? -operand.real() : operand.real());
  if (operand.is<Value::Big>() || operand.integer() == INT64_MIN) {
    const WholeNumber whole = operand.whole_number();
    if (op == Operator::invert) return Value::whole(-whole - WholeNumber(std::int64_t{1}));
    return Value::whole(op == Operator::add ? whole : -whole);
  }
  const std::int64_t whole = operand.integer();
  if (op == Operator::invert) return Value(~whole);
  return Value(op == Operator::add ? whole : -whole);
}

Value binary_operation(Operator op, const Value& a, const Value& b) {
  if (a.is<double>() && b.is<double>()) {
    const double x = *std::get_if<double>(&a.data), y = *std::get_if<double>(&b.data);
    if (op == Operator::multiply) return Value(x * y);
    if (op == Operator::add) return Value(x + y);
    if (op == Operator::subtract) return Value(x - y);
    if (op == Operator::divide && y != 0.0) return Value(x / y);
  }
  if (a.number() && b.number()) return numbers(op, a, b);
  const bool sequence_a = a.is<std::string>() || a.sequence(),
             sequence_b = b.is<std::string>() || b.sequence();
  if (op == Operator::add && sequence_a && a.data.index() == b.data.index()) return concatenated(a, b);
  if (op == Operator::multiply && sequence_a && b.integral()) return repeated(a, b.integer());
  if (op == Operator::multiply && sequence_b && a.integral()) return repeated(b, a.integer());
  if (op == Operator::modulo && a.is<std::string>()) return Value(percent_format(a.as<std::string>(), b));
  const bool set_operator = op == Operator::bit_or || op == Operator::bit_and || op == Operator::bit_xor ||
                            op == Operator::subtract;
  if (set_operator && a.is<Value::Set>() && b.is<Value::Set>()) return sets(op, a, b);
  if (op == Operator::bit_or && a.is<Value::Dict>() && b.is<Value::Dict>()) {
    ValueDict out = a.as<Value::Dict>().entries->dict;
    for (const auto& [key, value] : b.as<Value::Dict>().entries->dict) out.set(key, value);
    return Value::dict(std::move(out), a.as<Value::Dict>().dotted);
  }
  unsupported(op, a, b);
}

bool value_less(const Value& a, const Value& b) {
  return ordered(Operator::less, a, b);
}

bool compare_values(Operator op, const Value& a, const Value& b) {
  switch (op) {
    case Operator::equal:
      return equal(a, b);
    case Operator::not_equal:
      return !equal(a, b);
    case Operator::is:
      return identical(a, b);
    case Operator::is_not:
      return !identical(a, b);
    case Operator::in:
      return contains(b, a);
    case Operator::not_in:
      return !contains(b, a);
    default:
      return ordered(op, a, b);
  }
}

ValueList items_of(const Value& value) {
  ValueList out;
  if (!value.items(out))
    throw ExpressionError(fmt::format("{} ({}) is not iterable", value.brief(), value.type_name()));
  return out;
}

const Value* find_index(const Value& object, const Value& key) {
  if (object.is<Value::Dict>()) return object.as<Value::Dict>().entries->dict.find(key);
  if (object.sequence()) return &object.values()[position(key, object.values().size(), object.type_name())];
  if (object.is<Value::Object>() && key.is<std::string>())
    return object.as<Value::Object>().object->find(key.as<std::string>());
  return nullptr;
}

Value index_value(const Value& object, const Value& key) {
  if (const Value* found = find_index(object, key)) return *found;
  if (object.is<Value::Dict>()) {
    const ValueDict& dict = object.as<Value::Dict>().entries->dict;
    std::vector<std::string> names;
    for (const auto& [known, value] : dict) names.push_back(known.str());
    throw ExpressionError(fmt::format("key {} does not exist{}", key.brief(), did_you_mean(key.str(), names)),
                          "xacro.key");
  }
  if (object.is<Value::Object>() && key.is<std::string>()) {
    throw ExpressionError(fmt::format("key {} does not exist{}", key.brief(),
                                      did_you_mean(key.str(), object.as<Value::Object>().object->names())),
                          "xacro.key");
  }
  if (!object.is<std::string>())
    throw ExpressionError(fmt::format("{} ({}) has no items", object.brief(), object.type_name()));
  std::string_view text = object.as<std::string>();
  std::size_t i = position(key, count_characters(text), "str");
  for (; i > 0; --i) text.remove_prefix(character_length(text));
  return Value(std::string(text.substr(0, character_length(text))));
}

Value slice_value(const Value& object, const Value& from, const Value& to, const Value& by) {
  if (!object.sequence() && !object.is<std::string>())
    throw ExpressionError(fmt::format("{} ({}) cannot be sliced", object.brief(), object.type_name()));
  const auto bound = [](const Value& v) -> std::optional<std::int64_t> {
    if (v.is<Value::None>()) return std::nullopt;
    if (!v.integral()) throw ExpressionError("a slice needs integers");
    return v.integer();
  };
  ValueList items, out;
  object.items(items);
  const auto size = static_cast<std::int64_t>(items.size());
  const std::int64_t step = std::clamp<std::int64_t>(bound(by).value_or(1), -size - 1, size + 1);
  if (bound(by).value_or(1) == 0) throw ExpressionError("a slice's step cannot be zero");
  const auto placed = [&](std::optional<std::int64_t> v, std::int64_t absent) {
    if (!v) return absent;
    const std::int64_t at = *v < 0 ? *v + size : *v;
    return std::clamp<std::int64_t>(at, step > 0 ? 0 : -1, step > 0 ? size : size - 1);
  };
  const std::int64_t first = placed(bound(from), step > 0 ? 0 : size - 1),
                     last = placed(bound(to), step > 0 ? size : -1);
  for (std::int64_t i = first; step > 0 ? i < last : i > last; i += step)
    out.push_back(items[static_cast<std::size_t>(i)]);
  if (object.is<Value::Tuple>()) return Value::tuple(std::move(out));
  if (object.is<Value::List>()) return Value::list(std::move(out));
  std::string text;
  for (const Value& c : out) text += c.as<std::string>();
  return Value(std::move(text));
}

}  // namespace doppel
