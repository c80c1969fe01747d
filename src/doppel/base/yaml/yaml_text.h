#pragma once
// Names of the user in YAML that is generated.

#include <string>

namespace doppel {

// A double-quoted string of YAML.
inline std::string yaml_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

}  // namespace doppel
