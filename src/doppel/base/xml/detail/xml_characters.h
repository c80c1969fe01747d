#pragma once
// The parser's tests of single characters, for every byte of a file: inline and by table.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace doppel::xml_characters {

inline bool blank(char c) {
  return c == ' ' || c == '\n' || c == '\t' || c == '\r';
}

// What a character may be part of, and what ends a run of characters that nothing has to be done about. The
// NUL behind the text's end ends every run; there is none within it.
enum Class : std::uint8_t {
  kStartsName = 1,
  kInName = 2,
  kNotableInValue = 4,
  kNotableInText = 8,
  kBlankInText = 16  // but for the carriage return, which is notable
};
inline constexpr std::array<std::uint8_t, 256> kClasses = [] {
  std::array<std::uint8_t, 256> out{};
  for (unsigned c = 0; c < 256; ++c) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == ':' || c >= 0x80;
    const bool inside = letter || (c >= '0' && c <= '9') || c == '-' || c == '.';
    const bool both = c == '&' || c == '<' || c == '$' || c == '\r';
    const bool value = both || c < ' ' || c == '"' || c == '\'';
    const bool text = both || c == ']' || c == '\0';
    const bool blank = c == ' ' || c == '\n' || c == '\t';
    out[c] = static_cast<std::uint8_t>((blank ? kBlankInText : 0) | (letter ? kStartsName : 0) |
                                       (inside ? kInName : 0) | (value ? kNotableInValue : 0) |
                                       (text ? kNotableInText : 0));
  }
  return out;
}();
inline bool is(char c, Class what) {
  return (kClasses[static_cast<unsigned char>(c)] & what) != 0;
}

// ASCII that XML allows; written so that a compiler takes many at a time.
inline bool ordinary(const char* at, std::size_t size) {
  unsigned odd = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const auto c = static_cast<unsigned char>(at[i]);
    odd |= static_cast<unsigned>(c >= 0x80) |
           (static_cast<unsigned>(c < 0x20) & static_cast<unsigned>(c != '\n') &
            static_cast<unsigned>(c != '\t') & static_cast<unsigned>(c != '\r'));
  }
  return odd == 0;
}

// Every end of a line as one '\n'.
inline std::string line_ends(std::string_view raw) {
  std::string out;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] != '\r')
      out += raw[i];
    else if (i + 1 >= raw.size() || raw[i + 1] != '\n')
      out += '\n';
  }
  return out;
}

}  // namespace doppel::xml_characters
