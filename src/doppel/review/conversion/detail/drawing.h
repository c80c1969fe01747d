#pragma once
// Shared by the writers of drawings.

#include <fmt/format.h>

#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace doppel {

template <typename... Arguments>
void append(std::string& out, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Arguments>(arguments)...);
}

// The code points of UTF-8; invalid bytes become U+FFFD.
std::vector<char32_t> code_points(std::string_view utf8);

// The same character in the encoding of PDF's standard fonts (WinAnsi); '?' where it is not part of it.
std::uint8_t win_ansi(char32_t character);

}  // namespace doppel
