#pragma once
// A YAML text as a tree of values, each with its place. JSON is YAML.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API PlacedYaml {
  enum class Kind { missing, null, scalar, list, map };
  Kind kind = Kind::missing;
  std::string text;               // of a scalar
  std::vector<PlacedYaml> keys;   // of a map, as written
  std::vector<PlacedYaml> items;  // of a list; of a map one for each key
  SourceLocation where;

  explicit operator bool() const { return kind != Kind::missing; }
  [[nodiscard]] bool is_null() const { return kind == Kind::null; }
  [[nodiscard]] bool is_scalar() const { return kind == Kind::scalar; }
  [[nodiscard]] bool is_list() const { return kind == Kind::list; }
  [[nodiscard]] bool is_map() const { return kind == Kind::map; }
  // The value of a key of a map; Kind::missing if there is none.
  [[nodiscard]] const PlacedYaml& operator[](std::string_view key) const;
};

// The ids of the errors of one kind of file: "world.syntax" and so on.
struct YamlRules {
  std::string syntax, unreadable, too_large, invalid, unknown_key;
};

// Throws InputError: syntax, unreadable, too_large. `what` is "world file" in the message.
DOPPEL_API PlacedYaml load_yaml(const std::filesystem::path& file, const YamlRules& rules,
                                const std::string& what);

}  // namespace doppel
