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

// `text` without its byte order mark, as UTF-8 (not validated if it is declared as UTF-8); a view of
// `text` or of `converted`. Supports UTF-8, UTF-16 of both byte orders with a mark, and Latin-1 and
// ASCII by declaration. Valid UTF-8 is read as such regardless of the declaration, as in ros/xacro and
// urdfdom. Throws UnknownEncoding.
DOPPEL_API std::string_view as_utf8(std::string_view text, std::string& converted);

// The text as read by a parser without encodings: bytes that are not UTF-8 are Latin-1 characters, control
// characters are blanks, a NUL ends the text.
struct TolerantText {
  std::string text;
  std::size_t first_changed = std::string::npos;  // position in `text` of the first change
};
DOPPEL_API TolerantText tolerant_text(std::string_view bytes);

// "65", "x41"; 0 if it is not a valid character of XML.
DOPPEL_API char32_t character_reference(std::string_view digits);

}  // namespace doppel
