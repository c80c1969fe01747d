#pragma once
// The character encodings of XML files.

#include <stdexcept>
#include <string>
#include <string_view>

namespace doppel {

class UnknownEncoding : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

// `text` without its byte order mark, as UTF-8 (not checked where it claims to be that); a view of `text` or
// of `converted`. Knows UTF-8, UTF-16 of both byte orders with a mark, Latin-1 and ASCII by declaration. What
// is UTF-8 is read as that whatever it declares, as ros/xacro and urdfdom do.
std::string_view as_utf8(std::string_view text, std::string& converted);
bool is_utf8(std::string_view text);

// As a reader that knows no encodings takes it: bytes that are not UTF-8 stand for Latin-1's characters,
// control characters for blanks; a NUL ends the text.
struct TolerantText {
  std::string text;
  std::size_t first_changed = std::string::npos;  // where in `text` something is not as it was written
};
TolerantText tolerant_text(std::string_view bytes);

// How many bytes the character at the beginning takes; 0: not valid UTF-8.
std::size_t utf8_length(std::string_view text);
void append_utf8(std::string& out, char32_t code);
// "65", "x41"; 0 where it is not a character that XML allows.
char32_t character_reference(std::string_view digits);

}  // namespace doppel
