#pragma once
// Text as names and file endings are compared.

#include <string>
#include <string_view>

namespace doppel {

// ASCII letters in lower case, whatever the locale; all other bytes as they are.
inline std::string lowered(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return out;
}

}  // namespace doppel
