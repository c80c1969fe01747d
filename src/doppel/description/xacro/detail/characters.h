#pragma once
// Classes of ASCII characters as in Python, independent of the locale.

#include <cstddef>
#include <string_view>

namespace doppel {

inline constexpr std::string_view kBlanks = " \t\r\n\v\f";  // what str.strip() removes

constexpr bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}
constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

// Also of an empty text.
constexpr bool is_blank(std::string_view text) {
  return text.find_first_not_of(kBlanks) == std::string_view::npos;
}

constexpr std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

}  // namespace doppel
