// YAML's plain scalars as YAML 1.1 reads them (PyYAML's safe_load), and xacro's units.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/description/xacro/detail/characters.h"
#include "doppel/description/xacro/detail/xacro_yaml.h"

namespace doppel::xacro {
namespace {

class EmptyScope : public NameScope {
 public:
  const Value* find(std::string_view) override { return nullptr; }
  [[nodiscard]] std::vector<std::string> names() const override { return {}; }
};

bool digits_only(std::string_view text, std::string_view allowed) {
  return !text.empty() && text.find_first_not_of(allowed) == std::string_view::npos;
}

// [-+]?[0-9][0-9_]*, 0b..., 0x..., and octal with a leading zero.
std::optional<Value> integer(std::string_view text) {
  const std::size_t sign = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
  if (sign == text.size() || !is_digit(text[sign])) return std::nullopt;
  std::string digits(text.substr(sign));
  std::erase(digits, '_');
  int base = 10;
  std::string_view allowed = "0123456789";
  if (digits.starts_with("0b")) {
    base = 2, allowed = "01", digits.erase(0, 2);
  } else if (digits.starts_with("0x")) {
    base = 16, allowed = "0123456789abcdefABCDEF", digits.erase(0, 2);
  } else if (digits.size() > 1 && digits[0] == '0') {
    base = 8, allowed = "01234567";
  }
  if (!digits_only(digits, allowed)) return std::nullopt;
  return parse_whole((sign == 1 && text[0] == '-' ? "-" : "") + digits, base);
}

// A point is required, and a sign in the exponent: 1e-5 is a text in YAML 1.1.
std::optional<Value> real(std::string_view text) {
  const std::size_t sign = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
  const std::string_view body = text.substr(sign);
  const bool minus = text.starts_with('-');
  if (body == ".inf" || body == ".Inf" || body == ".INF") return Value(minus ? -HUGE_VAL : HUGE_VAL);
  if (sign == 0 && (body == ".nan" || body == ".NaN" || body == ".NAN")) return Value(std::nan(""));
  const std::size_t point = body.find('.');
  if (point == std::string_view::npos || body.find('.', point + 1) != std::string_view::npos)
    return std::nullopt;
  const std::size_t e = std::min(body.find_first_of("eE"), body.size());
  if (e < point) return std::nullopt;
  std::string mantissa(body.substr(0, e));
  const std::string_view exponent = body.substr(e);
  const bool signed_exponent = exponent.size() > 2 && (exponent[1] == '-' || exponent[1] == '+') &&
                               digits_only(exponent.substr(2), "0123456789");
  if (!exponent.empty() && !signed_exponent) return std::nullopt;
  std::erase(mantissa, '_');
  if (sign == 1 && point == 0) return std::nullopt;  // -.5 is a text in YAML 1.1
  if (mantissa.size() < 2 || !digits_only(mantissa, "0123456789.") || body[0] == '_') return std::nullopt;
  double out = 0;
  if (!parse_real(mantissa.append(exponent), out)) return std::nullopt;
  return Value(minus ? -out : out);
}

// 1:30 is 90.
std::optional<Value> sexagesimal(std::string_view text) {
  if (text.find(':') == std::string_view::npos) return std::nullopt;
  const bool minus = text.starts_with('-');
  std::string_view rest = text.substr(minus || text.starts_with('+') ? 1 : 0);
  double total = 0;
  bool point = false, first = true;
  while (true) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    const std::string_view part = rest.substr(0, end);
    const bool last = end == rest.size();
    if (!digits_only(part, last ? "0123456789." : "0123456789")) return std::nullopt;
    double value = 0;
    if (!parse_real(part, value) || (!first && value >= 60)) return std::nullopt;
    if (first && (part[0] == '0' || last)) return std::nullopt;
    point = part.find('.') != std::string_view::npos;
    total = total * 60 + value;
    if (last) break;
    rest.remove_prefix(end + 1);
    first = false;
  }
  if (minus) total = -total;
  if (point) return Value(total);
  return std::abs(total) < 9e15 ? std::optional<Value>(Value(static_cast<std::int64_t>(total)))
                                : std::nullopt;
}

// "word", "Word" or "WORD".
bool written(std::string_view text, std::string_view word) {
  if (text.size() != word.size()) return false;
  if (text == word) return true;
  const auto large = [](char c) { return static_cast<char>(c - 'a' + 'A'); };
  if (text[0] != large(word[0])) return false;
  return text.substr(1) == word.substr(1) ||
         std::equal(text.begin(), text.end(), word.begin(), [&](char a, char b) { return a == large(b); });
}

Value number(std::string_view text) {
  const PlainNumber plain = parse_plain(text);
  const std::size_t sign = text[0] == '-' || text[0] == '+' ? 1 : 0;
  const bool starts_with_point = sign == 1 && text.substr(1, 1) == ".";
  if (plain.kind == PlainNumber::Kind::real && !starts_with_point) return {plain.real};
  const bool octal = text.size() > sign + 1 && text[sign] == '0';
  if (plain.kind == PlainNumber::Kind::whole && !octal) return {plain.whole};
  if (auto whole = integer(text)) return *std::move(whole);
  if (auto other = real(text)) return *std::move(other);
  if (auto other = sexagesimal(text)) return *std::move(other);
  return Value(text);
}

}  // namespace

Value yaml_scalar(std::string_view text) {
  if (text.empty()) return {};
  const char c = text[0];
  if (is_digit(c) || c == '-' || c == '+' || c == '.') return number(text);
  if (c == '~' && text.size() == 1) return {};
  if (text.size() <= 5) {
    switch (c | 0x20) {
      case 'n':
        if (written(text, "null")) return {};
        if (written(text, "no")) return {false};
        break;
      case 't':
        if (written(text, "true")) return {true};
        break;
      case 'f':
        if (written(text, "false")) return {false};
        break;
      case 'y':
        if (written(text, "yes")) return {true};
        break;
      case 'o':
        if (written(text, "on")) return {true};
        if (written(text, "off")) return {false};
        break;
      default:
        break;
    }
  }
  return Value(text);
}

double yaml_unit(std::string_view tag) {
  if (tag == "!degrees") return std::numbers::pi / 180;
  if (tag == "!radians" || tag == "!meters") return 1;
  if (tag == "!millimeters") return 1e-3;
  if (tag == "!foot") return 0.3048;
  return tag == "!inches" ? 0.0254 : 0;
}

std::optional<Value> yaml_quantity(std::string_view tag, std::string_view text) {
  const double unit = yaml_unit(tag);
  if (unit == 0) return std::nullopt;
  double number = 0;
  if (parse_real(text, number)) return Value(number * unit);
  std::int64_t budget = 100'000;
  EmptyScope nothing;
  const Value value = evaluate(text, nothing, budget);
  if (value.number()) return Value(value.real() * unit);
  if (!value.is<std::string>() || !parse_real(value.as<std::string>(), number)) return std::nullopt;
  return Value(number * unit);
}

}  // namespace doppel::xacro
