// Numbers and characters as Python reads and writes them, whatever the locale.
#include <algorithm>
#include <charconv>
#include <cmath>

#include "doppel/description/value.h"
#include "doppel/description/xml_encoding.h"

namespace doppel {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n\v\f";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

bool has_letters(std::string_view text, std::string_view word) {
  return text.size() == word.size() && std::equal(text.begin(), text.end(), word.begin(), [](char a, char b) {
           return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b;
         });
}

}  // namespace

std::string format_real(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value < 0 ? "-inf" : "inf";
  char shortest[32];
  const char* const end =
      std::to_chars(shortest, shortest + sizeof shortest, value, std::chars_format::scientific).ptr;
  // "-d.ddde+xx": the sign, the digits without their point, the exponent.
  const char* at = shortest;
  std::string out;
  if (*at == '-') out += *at++;
  char digits[24];
  std::size_t count = 0;
  for (; *at != 'e'; ++at) {
    if (*at != '.') digits[count++] = *at;
  }
  int exponent = 0;
  std::from_chars(at + (at[1] == '+' ? 2 : 1), end, exponent);
  const auto put = [&](std::size_t from, std::size_t to) { out.append(digits + from, digits + to); };
  if (exponent < -4 || exponent >= 16) {
    put(0, 1);
    if (count > 1) {
      out += '.';
      put(1, count);
    }
    out += exponent < 0 ? "e-" : "e+";
    const std::string power = std::to_string(std::abs(exponent));
    return out + (power.size() < 2 ? "0" : "") + power;
  }
  if (exponent < 0) {
    out += "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0');
    put(0, count);
    return out;
  }
  const auto whole = static_cast<std::size_t>(exponent) + 1;
  if (count <= whole) {
    put(0, count);
    return out + std::string(whole - count, '0') + ".0";
  }
  put(0, whole);
  out += '.';
  put(whole, count);
  return out;
}

bool parse_integer(std::string_view text, std::int64_t& out, int base) {
  text = trimmed(text);
  const bool minus = text.starts_with('-');
  std::string digits(minus || text.starts_with('+') ? text.substr(1) : text);
  if (digits.empty() || digits[0] == '-' || digits[0] == '+') return false;
  const auto prefixed = [&](char letter) {
    return digits.size() > 2 && digits[0] == '0' && (digits[1] | 0x20) == letter;
  };
  for (const auto& [letter, radix] : {std::pair{'x', 16}, std::pair{'o', 8}, std::pair{'b', 2}}) {
    if (prefixed(letter) && (base == radix || base == 0)) {
      digits.erase(0, 2);
      base = radix;
    }
  }
  if (base == 0) base = 10;
  if (minus) digits.insert(0, "-");
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), out, base);
  return error == std::errc{} && end == digits.data() + digits.size();
}

bool parse_real(std::string_view text, double& out) {
  text = trimmed(text);
  const bool minus = text.starts_with('-');
  if (minus || text.starts_with('+')) text.remove_prefix(1);
  if (text.empty()) return false;
  if (has_letters(text, "inf") || has_letters(text, "infinity")) {
    out = minus ? -HUGE_VAL : HUGE_VAL;
    return true;
  }
  if (has_letters(text, "nan")) {
    out = std::nan("");
    return true;
  }
  if (text.find_first_not_of("0123456789.eE+-") != std::string_view::npos || text[0] == '-') return false;
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
