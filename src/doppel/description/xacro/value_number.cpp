// Numbers and characters as Python reads and writes them, independent of the locale.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "doppel/base/core/utf8.h"
#include "doppel/description/xacro/detail/characters.h"
#include "doppel/description/xacro/detail/powers_of_ten.h"
#include "doppel/description/xacro/detail/value.h"

namespace doppel {
namespace {

// The zeros of Unicode's decimal digits; nine more follow each. Source: DerivedNumericType.txt, Unicode 14.
constexpr char32_t kZeros[] = {
    0x660,   0x6F0,   0x7C0,   0x966,   0x9E6,   0xA66,   0xAE6,   0xB66,   0xBE6,   0xC66,   0xCE6,
    0xD66,   0xDE6,   0xE50,   0xED0,   0xF20,   0x1040,  0x1090,  0x17E0,  0x1810,  0x1946,  0x19D0,
    0x1A80,  0x1A90,  0x1B50,  0x1BB0,  0x1C40,  0x1C50,  0xA620,  0xA8D0,  0xA900,  0xA9D0,  0xA9F0,
    0xAA50,  0xABF0,  0xFF10,  0x104A0, 0x10D30, 0x11066, 0x110F0, 0x11136, 0x111D0, 0x112F0, 0x11450,
    0x114D0, 0x11650, 0x116C0, 0x11730, 0x118E0, 0x11950, 0x11C50, 0x11D50, 0x11DA0, 0x16A60, 0x16AC0,
    0x16B50, 0x1D7CE, 0x1D7D8, 0x1D7E2, 0x1D7EC, 0x1D7F6, 0x1E140, 0x1E2F0, 0x1E950, 0x1FBF0};

char32_t code_of(std::string_view character) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(character[i]); };
  if (character.size() == 1) return byte(0);
  char32_t code = byte(0) & (0x7FU >> character.size());
  for (std::size_t i = 1; i < character.size(); ++i) code = code << 6 | (byte(i) & 0x3FU);
  return code;
}

// The ASCII equivalent of the character in a number: a digit, a blank, or '?'.
char ascii_of(char32_t code) {
  if (code < 0x80) return static_cast<char>(code);
  const char32_t* const next = std::upper_bound(std::begin(kZeros), std::end(kZeros), code);
  if (next != std::begin(kZeros) && code - *(next - 1) < 10)
    return static_cast<char>('0' + (code - *(next - 1)));
  const bool blank = code == 0x85 || code == 0xA0 || code == 0x1680 || (code >= 0x2000 && code <= 0x200A) ||
                     code == 0x2028 || code == 0x2029 || code == 0x202F || code == 0x205F || code == 0x3000;
  return blank ? ' ' : '?';
}

// A number's text with ASCII's digits and blanks, and without the underscores that stand between two digits;
// "?" where an underscore stands elsewhere. `letters` are digits too.
std::string plain_digits(std::string_view text, bool letters) {
  std::string out;
  const auto digit = [letters](char c) {
    return (c >= '0' && c <= '9') || (letters && ((c | 0x20) >= 'a' && (c | 0x20) <= 'z'));
  };
  bool underscore = false;
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const char c = ascii_of(code_of(text.substr(0, length)));
    text.remove_prefix(std::min(length, text.size()));
    if (underscore && !digit(c)) return "?";
    if (c == '_' && (out.empty() || underscore || !digit(out.back()))) return "?";
    underscore = c == '_';
    if (!underscore) out += c;
  }
  return underscore ? "?" : out;
}
bool needs_plain_digits(std::string_view text) {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return c == '_' || static_cast<unsigned char>(c) >= 0x80; });
}

bool has_letters(std::string_view text, std::string_view word) {
  return text.size() == word.size() && std::equal(text.begin(), text.end(), word.begin(), [](char a, char b) {
           return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b;
         });
}

// The shortest digits of a double, without the point; its place follows from the exponent.
std::string python_notation(bool minus, std::string_view digits, int exponent) {
  std::string out;
  if (minus) out += '-';
  if (exponent < -4 || exponent >= 16) {
    out += digits[0];
    if (digits.size() > 1) (out += '.') += digits.substr(1);
    out += exponent < 0 ? "e-" : "e+";
    const std::string power = std::to_string(std::abs(exponent));
    return out + (power.size() < 2 ? "0" : "") + power;
  }
  if (exponent < 0) {
    out += "0.";
    out.append(static_cast<std::size_t>(-exponent - 1), '0');
    return out += digits;
  }
  const auto whole = static_cast<std::size_t>(exponent) + 1;
  if (digits.size() > whole) {
    (out += digits.substr(0, whole)) += '.';
    return out += digits.substr(whole);
  }
  (out += digits).append(whole - digits.size(), '0');
  return out += ".0";
}

// Signed digits in any base that std::from_chars supports.
bool parse_digits(bool minus, std::string_view digits, int base, std::int64_t& out) {
  std::uint64_t magnitude = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), magnitude, base);
  if (error != std::errc{} || end != digits.data() + digits.size()) return false;
  constexpr std::uint64_t kLimit = std::uint64_t{1} << 63;
  if (magnitude > kLimit || (magnitude == kLimit && !minus)) return false;
  out = static_cast<std::int64_t>(minus ? 0 - magnitude : magnitude);
  return true;
}

}  // namespace

std::string format_real(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value < 0 ? "-inf" : "inf";
  char text[40];
  if (std::abs(value) < 1e15) {
    const auto whole = static_cast<std::int64_t>(value);
    if (static_cast<double>(whole) == value) {
      char* at = text;
      if (std::signbit(value)) *at++ = '-';
      at = std::to_chars(at, text + sizeof text - 2, std::abs(whole)).ptr;
      std::memcpy(at, ".0", 2);
      return {text, static_cast<std::size_t>(at + 2 - text)};
    }
    // With a fraction, and not so small that Python writes an exponent: the shortest text is Python's.
    if (std::abs(value) >= 1e-4) {
      const char* const end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed).ptr;
      return {text, static_cast<std::size_t>(end - text)};
    }
  }
  const char* const end = std::to_chars(text, text + sizeof text, value, std::chars_format::scientific).ptr;
  // "-d.ddde+xx": the sign, the digits without their point, the exponent.
  const char* at = text + (text[0] == '-' ? 1 : 0);
  char digits[24];
  std::size_t count = 0;
  for (; *at != 'e'; ++at) {
    if (*at != '.') digits[count++] = *at;
  }
  int exponent = 0;
  std::from_chars(at + (at[1] == '+' ? 2 : 1), end, exponent);
  return python_notation(text[0] == '-', {digits, count}, exponent);
}

PlainNumber parse_plain(std::string_view text) {
  PlainNumber out;
  const char *at = text.data(), *const end = at + text.size();
  const bool minus = at != end && *at == '-';
  if (at != end && (minus || *at == '+')) ++at;
  const char* const begin = at;
  constexpr std::ptrdiff_t kMaxDigits = 18;  // that always fit
  if (end - begin > kMaxDigits + 1) return out;
  std::uint64_t sum = 0;
  const auto scan = [&] {
    for (; at != end && static_cast<unsigned char>(*at - '0') < 10; ++at)
      sum = sum * 10 + static_cast<unsigned char>(*at - '0');
  };
  scan();
  if (at == begin && end - begin < 2) return out;
  if (at == end) {
    if (end - begin > kMaxDigits) return out;
    const auto digits = static_cast<std::int64_t>(sum);
    out.kind = PlainNumber::Kind::whole;
    out.whole = minus ? -digits : digits;
    out.real = minus ? -static_cast<double>(digits) : static_cast<double>(digits);
    return out;
  }
  if (*at != '.') return out;
  const char* const fraction = ++at;
  scan();
  // The quotient is the nearest double as long as both operands are exact.
  constexpr std::uint64_t kExact = std::uint64_t{1} << 53;
  if (at != end || sum > kExact) return out;
  out.kind = PlainNumber::Kind::real;
  const double magnitude = static_cast<double>(sum) / kPowersOfTen[end - fraction];
  out.real = minus ? -magnitude : magnitude;
  return out;
}

namespace {

// A whole number's text in its parts; `cleaned` may own the digits.
struct WholeText {
  bool minus = false;
  std::string_view digits;
  int base = 10;
};
WholeText whole_text(std::string_view text, int base, std::string& cleaned) {
  if (needs_plain_digits(text)) text = cleaned = plain_digits(text, base == 0 || base > 10);
  text = trimmed(text);
  WholeText out{text.starts_with('-'), text, base == 0 ? 10 : base};
  if (out.minus || text.starts_with('+')) text.remove_prefix(1);
  if (text.size() > 2 && text[0] == '0' && base != 10) {
    const char letter = static_cast<char>(text[1] | 0x20);
    const int radix = letter == 'x' ? 16 : letter == 'o' ? 8 : letter == 'b' ? 2 : 0;
    if (radix != 0 && (base == radix || base == 0)) {
      text.remove_prefix(2);
      out.base = radix;
    }
  }
  out.digits = text;
  return out;
}

}  // namespace

bool parse_integer(std::string_view text, std::int64_t& out, int base) {
  if (base == 10) {
    const PlainNumber plain = parse_plain(text);
    if (plain.kind == PlainNumber::Kind::whole) out = plain.whole;
    if (plain.kind != PlainNumber::Kind::other) return plain.kind == PlainNumber::Kind::whole;
  }
  std::string cleaned;
  const WholeText parts = whole_text(text, base, cleaned);
  return parse_digits(parts.minus, parts.digits, parts.base, out);
}

std::optional<Value> parse_whole(std::string_view text, int base) {
  std::int64_t small = 0;
  if (parse_integer(text, small, base)) return Value(small);
  std::string cleaned;
  const WholeText parts = whole_text(text, base, cleaned);
  if (parts.digits.size() > WholeNumber::kMaxBits) return std::nullopt;
  const auto number = WholeNumber::parse(parts.digits, parts.base);
  if (!number || number->bits() > WholeNumber::kMaxBits) return std::nullopt;
  return Value::whole(parts.minus ? -*number : *number);
}

bool parse_real(std::string_view text, double& out) {
  const PlainNumber plain = parse_plain(text);
  if (plain.kind != PlainNumber::Kind::other) {
    out = plain.real;
    return true;
  }
  if (needs_plain_digits(text)) return parse_real(plain_digits(text, false), out);
  text = trimmed(text);
  const bool minus = text.starts_with('-');
  if (minus || text.starts_with('+')) text.remove_prefix(1);
  if (text.empty()) return false;
  const bool number = text[0] == '.' || (text[0] >= '0' && text[0] <= '9');
  if (!number) {
    if (has_letters(text, "inf") || has_letters(text, "infinity"))
      out = HUGE_VAL;
    else if (has_letters(text, "nan"))
      out = std::nan("");
    else
      return false;
    // The sign of what is not a number does not show.
    if (minus && !std::isnan(out)) out = -out;
    return true;
  }
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (end != text.data() + text.size()) return false;
  if (error == std::errc::result_out_of_range) {
    const std::size_t e = text.find_first_of("eE");
    const bool tiny = e != std::string_view::npos && e + 1 < text.size() && text[e + 1] == '-';
    out = tiny || e == std::string_view::npos ? 0.0 : HUGE_VAL;
  } else if (error != std::errc{}) {
    return false;
  }
  if (minus) out = -out;
  return true;
}

std::size_t character_length(std::string_view text) {
  return std::max<std::size_t>(1, utf8_length(text));
}

std::size_t count_characters(std::string_view text) {
  std::size_t out = 0;
  while (!text.empty()) {
    text.remove_prefix(character_length(text));
    ++out;
  }
  return out;
}

}  // namespace doppel
