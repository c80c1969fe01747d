#pragma once
// The character encodings of XML files.

#include <stdexcept>
#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API UnknownEncoding : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

// `text` without its byte order mark, as UTF-8 (not checked where it claims to be that); a view of `text` or
// of `converted`. Knows UTF-8, UTF-16 of both byte orders with a mark, Latin-1 and ASCII by declaration. What
// is UTF-8 is read as that whatever it declares, as ros/xacro and urdfdom do.
DOPPEL_API std::string_view as_utf8(std::string_view text, std::string& converted);
DOPPEL_API bool is_utf8(std::string_view text);

// As a reader that knows no encodings takes it: bytes that are not UTF-8 stand for Latin-1's characters,
// control characters for blanks; a NUL ends the text.
struct TolerantText {
  std::string text;
  std::size_t first_changed = std::string::npos;  // where in `text` something is not as it was written
};
DOPPEL_API TolerantText tolerant_text(std::string_view bytes);

// How many bytes the character at the beginning takes; 0: not valid UTF-8.
DOPPEL_API std::size_t utf8_length(std::string_view text);
DOPPEL_API void append_utf8(std::string& out, char32_t code);
// "65", "x41"; 0 where it is not a character that XML allows.
DOPPEL_API char32_t character_reference(std::string_view digits);

}  // namespace doppel
