#include "doppel/base/core/yaml_fix.h"

#include <array>

namespace doppel {

std::string yaml_fix(std::string_view problem) {
  struct Cause {
    std::string_view words, fix;
  };
  static constexpr std::array kCauses{
      Cause{"end of sequence flow", "close the list: a '[' before this place has no ']'"},
      Cause{"end of map flow", "close the map: a '{' before this place has no '}'"},
      Cause{"end of map not found", "indent this line as the other keys of its map"},
      Cause{"end of sequence not found", "indent this line as the other entries of its list ('- ')"},
      Cause{"illegal map value", "quote a text that contains ': ', or put the key on a line of its own"},
      Cause{"unknown escape", "in double quotes write \\\\ for a backslash, or use single quotes"},
      Cause{"illegal EOF in scalar", "close the quote before this place"},
      Cause{"EOF", "the file ends too early: close what is open before this place"},
      Cause{"tab", "indent YAML with spaces, not tabs"},
      Cause{"unknown token",
            "quote a text that begins with a special character such as @ or `; indent with spaces"}};
  for (const auto& [words, fix] : kCauses) {
    if (problem.find(words) != std::string_view::npos) return std::string(fix);
  }
  return "check indentation (spaces, not tabs), quotes and brackets before this place";
}

}  // namespace doppel
