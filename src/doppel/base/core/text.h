#pragma once
// Text for the comparison of names and file extensions.

#include <string>
#include <string_view>

namespace doppel {

// ASCII letters in lower case, independent of the locale; all other bytes unchanged.
inline std::string lowered(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return out;
}

}  // namespace doppel
