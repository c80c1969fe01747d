#pragma once
// What the writers of drawings share.

#include <cstdint>
#include <string_view>
#include <vector>

namespace doppel {

// The code points of UTF-8; what is none counts as U+FFFD.
std::vector<char32_t> code_points(std::string_view utf8);

// The same character in the encoding of PDF's standard fonts (WinAnsi); '?' where it is not in there.
std::uint8_t win_ansi(char32_t character);

}  // namespace doppel
