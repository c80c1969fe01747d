#pragma once
// Reads the fields of a YAML file and collects all of its errors, each at its place.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/yaml/placed_yaml.h"
#include "doppel/export.h"

namespace doppel {

// nullopt: neither true nor false, in one of YAML's spellings.
DOPPEL_API std::optional<bool> flag_in(const PlacedYaml& value);

// `what` names a value in messages. A value with an error is 0 or empty.
class DOPPEL_API YamlFields {
 public:
  explicit YamlFields(YamlRules rules) : rules_(std::move(rules)) {}

  void error(const PlacedYaml& value, const std::string& message, const std::string& fix = "");
  // True for a map; every key that is not among `keys`, and every second one, is an error.
  bool fields(const PlacedYaml& value, const std::string& what, const std::vector<std::string>& keys);
  double number(const PlacedYaml& value, const std::string& what);  // finite
  // `size` of them.
  std::vector<double> numbers(const PlacedYaml& value, const std::string& what, std::size_t size);
  bool flag(const PlacedYaml& value, const std::string& what);
  std::string text(const PlacedYaml& value, const std::string& what);  // not empty
  std::vector<std::string> texts(const PlacedYaml& value, const std::string& what);
  // The index of the text among `choices`.
  std::size_t choice(const PlacedYaml& value, const std::string& what,
                     const std::vector<std::string>& choices);

  [[nodiscard]] Diagnostics& errors() { return errors_; }

 private:
  YamlRules rules_;
  Diagnostics errors_;
};

}  // namespace doppel
