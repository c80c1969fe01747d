#pragma once
// UTF-8 one character at a time (RFC 3629), and UTF-16.

#include <cstddef>
#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

struct Utf8Char {
  char32_t code = 0;     // the byte itself where `valid` is false
  std::size_t size = 1;  // in bytes
  bool valid = true;
};

// Precondition: at < text.size(). Overlong forms, surrogates and cut sequences are invalid bytes of size one.
inline Utf8Char next_utf8(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[at + i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return {lead, 1, true};
  const std::size_t size = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || at + size > text.size()) return {lead, 1, false};
  char32_t code = lead & (0x7F >> size);
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {lead, 1, false};
    code = code << 6 | (byte(i) & 0x3F);
  }
  const bool overlong = (size == 3 && code < 0x800) || (size == 4 && code < 0x10000);
  if (overlong || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {lead, 1, false};
  return {code, size, true};
}

// The number of bytes of the first character; 0: it is not valid, or there is none.
DOPPEL_API std::size_t utf8_length(std::string_view text);
DOPPEL_API bool is_utf8(std::string_view text);
DOPPEL_API void append_utf8(std::string& out, char32_t code);

constexpr char32_t kReplacementCharacter = 0xFFFD;

// Half a surrogate pair becomes U+FFFD.
inline std::string to_utf8(std::u16string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char32_t code = text[i];
    const bool pair = code >= 0xD800 && code < 0xDC00 && i + 1 < text.size() && text[i + 1] >= 0xDC00 &&
                      text[i + 1] < 0xE000;
    if (pair) {
      code = 0x10000 + ((code - 0xD800) << 10) + (text[++i] - 0xDC00);
    } else if (code >= 0xD800 && code < 0xE000) {
      code = kReplacementCharacter;
    }
    append_utf8(out, code);
  }
  return out;
}

// A byte that is not valid UTF-8 becomes U+FFFD.
inline std::u16string to_utf16(std::string_view text) {
  std::u16string out;
  for (std::size_t at = 0; at < text.size();) {
    const Utf8Char c = next_utf8(text, at);
    at += c.size;
    const char32_t code = c.valid ? c.code : kReplacementCharacter;
    if (code >= 0x10000) {
      out += static_cast<char16_t>(0xD800 + ((code - 0x10000) >> 10));
      out += static_cast<char16_t>(0xDC00 + ((code - 0x10000) & 0x3FF));
    } else {
      out += static_cast<char16_t>(code);
    }
  }
  return out;
}

}  // namespace doppel
