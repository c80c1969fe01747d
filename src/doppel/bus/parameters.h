#pragma once
// The parameters of one node, as ROS 2 has them: declared with a default and a description, typed, some
// read-only.

#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "doppel/core/status.h"
#include "doppel/export.h"

namespace doppel {

using ParameterValue =
    std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<bool>,
                 std::vector<std::int64_t>, std::vector<double>, std::vector<std::string>>;

// "double array" and so on, for messages.
DOPPEL_API std::string_view parameter_type_name(const ParameterValue& value);
DOPPEL_API std::string to_string(const ParameterValue& value);
// As YAML 1.2 reads a scalar or a flow sequence: "1" int, "1.0" double, "true" bool, "[a, b]" strings.
DOPPEL_API ParameterValue parse_parameter(std::string_view text);

struct NamedParameter {
  std::string node, name;
  ParameterValue value;
};

// What a number may be, ends included; describe_parameters tells it. An infinite end is none.
struct ParameterRange {
  double from = 0, to = 0;
};
// Of an integer or a double, "-1.0 is below 0"; ok for everything else.
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
  // What became of a declaration or of one call of set(), for /parameter_events.
  struct Event {
    std::vector<const Declared*> declared, changed, deleted;
  };

  // rclcpp's allow_undeclared_parameters: setting an unknown name declares it, with dynamic typing, and
  // asking for one is answered with "not set". At most kMaxUndeclared can be there.
  void allow_undeclared() { allows_undeclared_ = true; }
  [[nodiscard]] bool allows_undeclared() const { return allows_undeclared_; }
  static constexpr std::size_t kMaxUndeclared = 1000;

  // The value it has now: `initial`, or what was set before the declaration if undeclared names are allowed
  // and it fits. Throws std::logic_error if declared before.
  ParameterValue declare(std::string name, ParameterValue initial, ParameterOptions options = {});
  [[nodiscard]] const Declared* find(std::string_view name) const;
  // An int is taken for a double; every other change of type, an unknown name (with the nearest) or a
  // read-only one is refused, and so is what the range or the check refuses. Listeners hear of it, but not of
  // what is deleted.
  Status set(std::string_view name, ParameterValue value);
  // All of them or, with the first reason against it, none.
  Status set_all(std::vector<std::pair<std::string, ParameterValue>> wanted);
  // Whoever declared a read-only parameter says what it is now.
  void update_read_only(std::string_view name, ParameterValue value);
  void on_change(Listener listener) { listeners_.push_back(std::move(listener)); }
  void on_event(std::function<void(const Event&)> listener) { on_event_ = std::move(listener); }
  [[nodiscard]] const std::list<Declared>& all() const { return declared_; }
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  // Why `value` cannot be set; it becomes what would be stored.
  Status check(std::string_view name, ParameterValue& value) const;
  [[nodiscard]] Status check_undeclared(std::string_view name, std::size_t more) const;
  void store(const std::string& name, const ParameterValue& value, Event& event, std::list<Declared>& gone);
  Declared* find_mine(std::string_view name);

  std::list<Declared> declared_;         // in order of declaration; they stay where they are
  std::vector<std::string> undeclared_;  // those among them that only set() made
  bool allows_undeclared_ = false;
  std::vector<Listener> listeners_;
  std::function<void(const Event&)> on_event_;
};

}  // namespace doppel
