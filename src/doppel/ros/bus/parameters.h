#pragma once
// The parameters of one node, as in ROS 2: declared with a default and a description, typed, some read-only.
// The loop's thread.

#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/export.h"

namespace doppel {

using ParameterValue =
    std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<bool>,
                 std::vector<std::int64_t>, std::vector<double>, std::vector<std::string>>;

// "double array" and so on, for messages.
DOPPEL_API std::string_view parameter_type_name(const ParameterValue& value);
DOPPEL_API std::string to_string(const ParameterValue& value);
// Reads a scalar or a flow sequence as YAML 1.2 does: "1" int, "1.0" double, "true" bool, "[a, b]" strings.
DOPPEL_API ParameterValue parse_parameter(std::string_view text);

struct NamedParameter {
  std::string node, name;
  ParameterValue value;
};

// The closed range of a number, as in describe_parameters. An infinite end is no limit.
struct ParameterRange {
  double from = 0, to = 0;
};
// Refuses an integer or a double outside of the range: "-1.0 is below 0"; ok for all other types.
DOPPEL_API Status check_range(const ParameterRange& range, const ParameterValue& value);

struct ParameterOptions {
  using Check = std::function<Status(const ParameterValue&)>;
  std::string description = {};
  bool read_only = false;
  Check check = {};  // may be empty
  std::optional<ParameterRange> range = std::nullopt;
  bool dynamic_typing = false;  // a value of another type may be set, and "not set" deletes it
};

class DOPPEL_API Parameters {
 public:
  using Check = ParameterOptions::Check;
  using Listener = std::function<void(const std::string& name, const ParameterValue& value)>;

  struct Declared {
    std::string name;
    ParameterValue value;
    ParameterOptions options;
  };
  // The effect of a declaration or of one call of set(), for /parameter_events.
  struct Event {
    std::vector<const Declared*> declared, changed, deleted;
  };

  // rclcpp's allow_undeclared_parameters: setting an unknown name declares it, with dynamic typing, and
  // reading one gives "not set". At most kMaxUndeclared.
  void allow_undeclared() { allows_undeclared_ = true; }
  [[nodiscard]] bool allows_undeclared() const { return allows_undeclared_; }
  static constexpr std::size_t kMaxUndeclared = 1000;

  // Returns the parameter's value: `initial`, or the value set before the declaration if undeclared names are
  // allowed and it is valid. Throws std::logic_error if it is already declared.
  ParameterValue declare(std::string name, ParameterValue initial, ParameterOptions options = {});
  [[nodiscard]] const Declared* find(std::string_view name) const;
  // An int is converted to a double. Refuses any other change of type, an unknown name (with the nearest),
  // a read-only parameter, and a value that the range or the check refuses. Listeners are called, except
  // for deleted parameters.
  Status set(std::string_view name, ParameterValue value);
  // Sets all of them or, with the first reason for refusal, none.
  Status set_all(std::vector<std::pair<std::string, ParameterValue>> wanted);
  // For the owner of a read-only parameter.
  void update_read_only(std::string_view name, ParameterValue value);
  void on_change(Listener listener) { listeners_.push_back(std::move(listener)); }
  void on_event(std::function<void(const Event&)> listener) { on_event_ = std::move(listener); }
  [[nodiscard]] const std::list<Declared>& all() const { return declared_; }
  [[nodiscard]] std::vector<std::string> names() const;
  // Increases with every declaration and change in this process, so that copies are made only after one.
  [[nodiscard]] static std::uint64_t changes();

 private:
  // Refuses with the reason why `value` cannot be set; converts it to the stored type.
  Status check(std::string_view name, ParameterValue& value) const;
  [[nodiscard]] Status check_undeclared(std::string_view name, std::size_t more) const;
  void store(const std::string& name, const ParameterValue& value, Event& event, std::list<Declared>& gone);
  Declared* find_mine(std::string_view name);

  std::list<Declared> declared_;         // in order of declaration; a list, so that addresses stay valid
  std::vector<std::string> undeclared_;  // names that were declared only by set()
  bool allows_undeclared_ = false;
  std::vector<Listener> listeners_;
  std::function<void(const Event&)> on_event_;
};

}  // namespace doppel
