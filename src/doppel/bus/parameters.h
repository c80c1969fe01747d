#pragma once
// The parameters of one node, as ROS 2 has them: declared with a default and a description, typed, some
// read-only.

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "doppel/core/status.h"

namespace doppel {

using ParameterValue =
    std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<bool>,
                 std::vector<std::int64_t>, std::vector<double>, std::vector<std::string>>;

// "double array" and so on, for messages.
std::string_view parameter_type_name(const ParameterValue& value);
std::string to_string(const ParameterValue& value);
// As YAML 1.2 reads a scalar or a flow sequence: "1" int, "1.0" double, "true" bool, "[a, b]" strings.
ParameterValue parse_parameter(std::string_view text);

struct NamedParameter {
  std::string node, name;
  ParameterValue value;
};

class Parameters {
 public:
  using Check = std::function<Status(const ParameterValue&)>;
  using Listener = std::function<void(const std::string& name, const ParameterValue& value)>;

  struct Declared {
    std::string name, description;
    ParameterValue value;
    bool read_only = false;
    Check check;  // may be empty
  };

  // Throws std::logic_error if declared before.
  void declare(std::string name, ParameterValue initial, std::string description, bool read_only = false,
               Check check = {});
  [[nodiscard]] const Declared* find(std::string_view name) const;
  // An int is taken for a double; every other change of type, an unknown name (with the nearest) or a
  // read-only one is refused, and so is what the check refuses. Listeners hear of it.
  Status set(std::string_view name, ParameterValue value);
  // What set() would say, without doing it; `value` becomes what would be stored.
  Status check(std::string_view name, ParameterValue& value) const;
  void on_change(Listener listener) { listeners_.push_back(std::move(listener)); }
  [[nodiscard]] const std::vector<Declared>& all() const { return declared_; }
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::vector<Declared> declared_;  // in order of declaration
  std::vector<Listener> listeners_;
};

}  // namespace doppel
