#pragma once
// A controller: a class that claims command interfaces, reads state interfaces and is updated at its rate.
// The life cycle is ros2_control's: unconfigured -> inactive -> active. All functions but update() are called
// between steps and may allocate. All are called by one thread at a time: the loop's thread, or the one that
// holds the LoopGate (control_loop.h).
//
// For a controller outside the tree, build a shared library against these headers and end its source with
//   DOPPEL_EXPORT_CONTROLLER(my_package::MyController, "my_package/MyController")

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/base/core/saved_part.h"
#include "doppel/base/core/status.h"
#include "doppel/base/core/time.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel {

class CommandGuard;  // command_guard.h

struct InterfaceConfiguration {
  enum class Kind { none, all, individual } kind = Kind::none;
  std::vector<std::string> names;  // "Revolute 1/position", in the order of the handles
};

// A claimed interface: reading and writing are plain loads and stores. Valid while the controller is active.
// Units by the interface (hardware.h): rad or m, per s, N m or N.
class DOPPEL_API StateHandle {
 public:
  StateHandle() = default;
  StateHandle(const std::string* full_name, std::size_t slash, const double* value)
      : name_(full_name), slash_(slash), value_(value) {}
  [[nodiscard]] const std::string& full_name() const { return *name_; }
  [[nodiscard]] std::string prefix() const { return name_->substr(0, slash_); }
  [[nodiscard]] std::string interface_name() const { return name_->substr(slash_ + 1); }
  [[nodiscard]] double get() const { return *value_; }

 private:
  const std::string* name_ = nullptr;
  std::size_t slash_ = 0;
  const double* value_ = nullptr;
};

class DOPPEL_API CommandHandle {
 public:
  CommandHandle() = default;
  CommandHandle(const std::string* full_name, std::size_t slash, double* value)
      : name_(full_name), slash_(slash), value_(value) {}
  [[nodiscard]] const std::string& full_name() const { return *name_; }
  [[nodiscard]] std::string prefix() const { return name_->substr(0, slash_); }
  [[nodiscard]] std::string interface_name() const { return name_->substr(slash_ + 1); }
  [[nodiscard]] double get() const { return *value_; }  // the last command; NaN: none yet
  void set(double value) { *value_ = value; }

 private:
  const std::string* name_ = nullptr;
  std::size_t slash_ = 0;
  double* value_ = nullptr;
};

// The transform of the robot's root link that a controller of a mobile base publishes.
struct BaseTransform {
  std::string topic;          // "/tf"
  std::string parent, child;  // frames with their prefixes: "odom", "base_link"
};

// The reason of a goal that ends because the twin was restored to a time at which it was not active.
[[nodiscard]] DOPPEL_API std::string restored_reason(Time restored);

// The environment of a controller; outlives it. The model may be replaced by another one with the same joints
// while the controller runs, so a controller must not keep the pointer.
struct ControllerContext {
  std::string name;      // "omarm_arm_controller"
  Node* node = nullptr;  // "/omarm_arm_controller"
  const Model* model = nullptr;
  const Log* log = nullptr;
  ParameterOverrides* overrides = nullptr;  // this controller's part of the YAML files
  double update_rate = 0;                   // Hz, the rate of update() after rounding to the manager's period
  std::string type;                         // "joint_trajectory_controller/JointTrajectoryController"
  CommandGuard* guard = nullptr;            // that permits its motions; nullptr: none
};

class DOPPEL_API Controller {
 public:
  virtual ~Controller() = default;

  // Declares and checks parameters (parameter_file.h). Throws InputError for invalid values, with their place
  // in the YAML.
  virtual void on_init(ControllerContext& context) = 0;
  [[nodiscard]] virtual InterfaceConfiguration command_interfaces() const = 0;  // valid once configured
  [[nodiscard]] virtual InterfaceConfiguration state_interfaces() const = 0;
  // A refusal, or an exception, leaves the state as it was and is logged.
  virtual Status on_configure() { return {}; }
  virtual Status on_activate() { return {}; }  // handles below are filled
  virtual Status on_deactivate() { return {}; }
  virtual Status on_cleanup() { return {}; }

  // In the loop, at this controller's rate: no allocation, no lock, no throw.
  virtual void update(Time now, Duration period) = 0;

  // Between steps, at housekeeping_rate() while active: reports, results, and other work that may allocate.
  virtual void housekeeping(Time /*now*/) {}
  // Between steps, while simulated time is paused or was set back: a broadcaster publishes the present state,
  // because update() is not called.
  virtual void publish_state(Time /*now*/) {}
  // The rate of housekeeping, Hz of simulated time.
  [[nodiscard]] virtual double housekeeping_rate() const { return 20.0; }

  // A chainable controller takes commands from other controllers: its reference interfaces, "joint/position",
  // which they command as "<controller>/joint/position". Valid once configured; empty: it is not chainable.
  [[nodiscard]] virtual std::vector<std::string> reference_interfaces() const { return {}; }
  // Between ticks, while active. True: from now on another controller commands the references, earlier in the
  // same tick, and commands from topics and actions are ignored. False: no other controller does.
  virtual void set_chained_mode(bool /*chained*/) {}

  // Between steps, while active: the transform whose child is the base, so that no other node publishes
  // another parent of it; nullptr: none.
  [[nodiscard]] virtual const BaseTransform* base_transform() const { return nullptr; }

  // In the loop: the value that the controller follows for "joint/position", rad or m, if it is not a command
  // or reference interface; NaN: none.
  [[nodiscard]] virtual double followed_value(std::string_view /*interface*/) const { return kNaN; }

  // -- saved states of a running twin (docs/saved_states.md), between steps
  // Writes what changes while the controller runs into the slot, whose memory it reuses (save_run() in
  // saved_part.h). Parameters are not part of it. False: it cannot be saved; a restore reactivates it, as a
  // reset does.
  [[nodiscard]] virtual bool save(SavedSlot& /*slot*/) const { return false; }
  // Becomes as it was then: configured and, if it was active then, active with the same handles. May be
  // called twice. Goals that were not active then are aborted, with the time `now` to which the twin is
  // restored.
  virtual void restore(const SavedPart& /*saved*/, Time /*now*/) {}
  // Ends its goals as aborted, for this reason.
  virtual void abort_goals(const std::string& /*why*/) {}

  // Filled by the controller manager before on_activate, emptied after on_deactivate.
  std::vector<CommandHandle> command_handles;
  std::vector<StateHandle> state_handles;
  // In the order of reference_interfaces(), from on_configure to on_cleanup. In chained mode NaN means no
  // command yet; otherwise the controller writes the values that it follows, so that they can be observed.
  std::vector<CommandHandle> reference_handles;
};

// Controller types by their ROS names. Built-in types and libraries register theirs at the start, before
// other threads use it.
class DOPPEL_API ControllerRegistry {
 public:
  using Factory = std::function<std::unique_ptr<Controller>()>;
  struct Type {
    std::string name, base_class, library;  // library: empty for those built in
    Factory make;
  };

  void add(std::string name, Factory make, std::string library = "");
  [[nodiscard]] const Type* find(std::string_view name) const;  // nullptr: unknown
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::vector<Type> types_;
};

}  // namespace doppel

#define DOPPEL_EXPORT_CONTROLLER(Class, type_name)                                             \
  extern "C" DOPPEL_API void doppel_register_controllers(doppel::ControllerRegistry& registry, \
                                                         const char* library) {                \
    registry.add(                                                                              \
        type_name, [] { return std::make_unique<Class>(); }, library);                         \
  }
