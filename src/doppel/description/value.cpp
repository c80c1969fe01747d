#include "doppel/description/value.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace doppel {
namespace {

std::string quoted(const std::string& text) {
  const char quote = text.find('\'') != std::string::npos && text.find('"') == std::string::npos ? '"' : '\'';
  std::string out(1, quote);
  for (const char c : text) {
    if (c == quote || c == '\\') out += '\\';
    if (c == '\n')
      out += "\\n";
    else
      out += c;
  }
  return out + quote;
}

std::string joined(const ValueList& items) {
  std::string out;
  for (const Value& item : items) out += (out.empty() ? "" : ", ") + item.repr();
  return out;
}

}  // namespace

std::string format_real(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value < 0 ? "-inf" : "inf";
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific).ptr;
  const std::string text(buffer, end);
  const std::size_t e = text.find('e');
  const int exponent = std::stoi(text.substr(e + 1));
  std::string sign = text[0] == '-' ? "-" : "";
  std::string digits;
  for (const char c : text.substr(0, e)) {
    if (c >= '0' && c <= '9') digits += c;
  }
  if (exponent < -4 || exponent >= 16) {
    const std::string mantissa = digits.size() == 1 ? digits : digits.substr(0, 1) + "." + digits.substr(1);
    return fmt::format("{}{}e{}{:02}", sign, mantissa, exponent < 0 ? '-' : '+', std::abs(exponent));
  }
  if (exponent < 0) return sign + "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0') + digits;
  const auto whole = static_cast<std::size_t>(exponent) + 1;
  if (digits.size() <= whole) return sign + digits + std::string(whole - digits.size(), '0') + ".0";
  return sign + digits.substr(0, whole) + "." + digits.substr(whole);
}

std::int64_t Value::integer() const {
  return is<bool>() ? (as<bool>() ? 1 : 0) : as<std::int64_t>();
}

double Value::real() const {
  return is<double>() ? as<double>() : static_cast<double>(integer());
}

bool Value::truth() const {
  if (number()) return real() != 0.0;
  if (is<std::string>()) return !as<std::string>().empty();
  if (is<List>()) return !as<List>().items->empty();
  if (is<Tuple>()) return !as<Tuple>().items->empty();
  if (is<Dict>()) return !as<Dict>().items->empty();
  return !is<None>();
}

const char* Value::type_name() const {
  static constexpr const char* kNames[] = {"NoneType", "bool",  "int",  "float",   "str",
                                           "list",     "tuple", "dict", "function"};
  return kNames[data.index()];
}

std::string Value::str() const {
  return is<std::string>() ? as<std::string>() : repr();
}

std::string Value::repr() const {
  if (is<None>()) return "None";
  if (is<bool>()) return as<bool>() ? "True" : "False";
  if (is<std::int64_t>()) return std::to_string(as<std::int64_t>());
  if (is<double>()) return format_real(as<double>());
  if (is<std::string>()) return quoted(as<std::string>());
  if (is<List>()) return "[" + joined(*as<List>().items) + "]";
  if (is<Tuple>()) return "(" + joined(*as<Tuple>().items) + (as<Tuple>().items->size() == 1 ? ",)" : ")");
  if (is<Dict>()) {
    std::string out;
    for (const auto& [key, value] : *as<Dict>().items)
      out += (out.empty() ? "" : ", ") + key.repr() + ": " + value.repr();
    return "{" + out + "}";
  }
  return "<function " + as<Function>().name + ">";
}

bool Value::items(ValueList& out) const {
  if (is<List>()) return out = *as<List>().items, true;
  if (is<Tuple>()) return out = *as<Tuple>().items, true;
  out.clear();
  if (is<Dict>()) {
    for (const auto& [key, value] : *as<Dict>().items) out.push_back(key);
    return true;
  }
  if (!is<std::string>()) return false;
  for (const char c : as<std::string>()) out.emplace_back(std::string(1, c));
  return true;
}

const Value* Value::get(const Value& key) const {
  if (!is<Dict>()) return nullptr;
  for (const auto& [k, v] : *as<Dict>().items) {
    if (equal(k, key)) return &v;
  }
  return nullptr;
}

bool equal(const Value& a, const Value& b) {
  if (a.number() && b.number()) {
    return a.integral() && b.integral() ? a.integer() == b.integer() : a.real() == b.real();
  }
  if (a.data.index() != b.data.index()) return false;
  if (a.is<Value::None>()) return true;
  if (a.is<std::string>()) return a.as<std::string>() == b.as<std::string>();
  if (a.is<Value::Function>()) return a.as<Value::Function>().call == b.as<Value::Function>().call;
  if (a.is<Value::Dict>()) {
    const ValueDict& x = *a.as<Value::Dict>().items;
    if (x.size() != b.as<Value::Dict>().items->size()) return false;
    for (const auto& [key, value] : x) {
      const Value* other = b.get(key);
      if (other == nullptr || !equal(value, *other)) return false;
    }
    return true;
  }
  ValueList x, y;
  a.items(x);
  b.items(y);
  if (x.size() != y.size()) return false;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!equal(x[i], y[i])) return false;
  }
  return true;
}

}  // namespace doppel
