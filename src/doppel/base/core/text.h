#pragma once
// Text for the comparison of names and file extensions, and numbers in text.

#include <optional>
#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// ASCII letters in lower case, independent of the locale; all other bytes unchanged.
inline std::string lowered(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return out;
}

// A finite number in the C locale, surrounded only by blanks; nullopt otherwise.
DOPPEL_API std::optional<double> parse_number(std::string_view text);

}  // namespace doppel
