#include "doppel/base/yaml/yaml_fields.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "doppel/base/core/names.h"

namespace doppel {

std::optional<bool> flag_in(const PlacedYaml& value) {
  bool out = false;
  if (!value.is_scalar() || !YAML::convert<bool>::decode(YAML::Node(value.text), out)) return std::nullopt;
  return out;
}

void YamlFields::error(const PlacedYaml& value, const std::string& message, const std::string& fix) {
  errors_.error(rules_.invalid, value.where, message, fix);
}

bool YamlFields::fields(const PlacedYaml& value, const std::string& what,
                        const std::vector<std::string>& keys) {
  if (!value.is_map()) {
    error(value, what + " must be a map");
    return false;
  }
  std::set<std::string> seen;
  for (const PlacedYaml& key : value.keys) {
    if (std::find(keys.begin(), keys.end(), key.text) == keys.end()) {
      errors_.error(rules_.unknown_key, key.where,
                    fmt::format("{} has no key '{}'{}", what, key.text, did_you_mean(key.text, keys)));
    } else if (!seen.insert(key.text).second) {
      error(key, fmt::format("the key '{}' is given twice", key.text));
    }
  }
  return true;
}

double YamlFields::number(const PlacedYaml& value, const std::string& what) {
  double out = 0;
  if (value.is_scalar() && YAML::convert<double>::decode(YAML::Node(value.text), out) && std::isfinite(out))
    return out;
  error(value,
        fmt::format("{} must be a number{}", what, value.is_scalar() ? ", not '" + value.text + "'" : ""));
  return 0;
}

std::vector<double> YamlFields::numbers(const PlacedYaml& value, const std::string& what, std::size_t size) {
  std::vector<double> out(size, 0.0);
  if (!value.is_list() || value.items.size() != size) {
    error(value, fmt::format("{} must be a list of {} numbers", what, size));
    return out;
  }
  for (std::size_t i = 0; i < size; ++i) out[i] = number(value.items[i], what);
  return out;
}

bool YamlFields::flag(const PlacedYaml& value, const std::string& what) {
  const std::optional<bool> out = flag_in(value);
  if (!out) {
    error(value, fmt::format("{} must be true or false{}", what,
                             value.is_scalar() ? ", not '" + value.text + "'" : ""));
  }
  return out.value_or(false);
}

std::string YamlFields::text(const PlacedYaml& value, const std::string& what) {
  if (value.is_scalar() && !value.text.empty()) return value.text;
  error(value, what + " must be a string");
  return "";
}

std::vector<std::string> YamlFields::texts(const PlacedYaml& value, const std::string& what) {
  std::vector<std::string> out;
  if (!value.is_list()) {
    error(value, what + " must be a list of strings");
    return out;
  }
  for (const PlacedYaml& item : value.items) out.push_back(text(item, what));
  return out;
}

std::size_t YamlFields::choice(const PlacedYaml& value, const std::string& what,
                               const std::vector<std::string>& choices) {
  const std::string written = text(value, what);
  const auto found = std::find(choices.begin(), choices.end(), written);
  if (found != choices.end()) return static_cast<std::size_t>(found - choices.begin());
  error(value, fmt::format("{} is '{}'; it must be one of {}{}", what, written, fmt::join(choices, ", "),
                           did_you_mean(written, choices)));
  return 0;
}

}  // namespace doppel
