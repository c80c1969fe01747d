#pragma once
// UTF-8 one character at a time (RFC 3629), for writers that must know what they print.

#include <string_view>

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

}  // namespace doppel
