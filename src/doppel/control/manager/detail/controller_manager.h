#pragma once
// The implementation of the controller manager, shared by its source files: the loaded controllers and the
// functions of each file.

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>

#include "doppel/base/core/thrown.h"
#include "doppel/control/manager/controller_manager.h"
#include "doppel/control/manager/detail/guarded_commands.h"
#include "doppel/control/manager/detail/joint_limiter.h"
#include "doppel/control/manager/detail/resource_table.h"
#include "doppel/control/manager/rates.h"
#include "doppel/ros/bus/node_arguments.h"
#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/messages/lifecycle_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {

// Calls a transition of a controller's life cycle. A controller of a plugin library may throw anything; an
// exception is a refusal.
template <typename Transition>
Status attempt(const Transition& transition) {
  try {
    return transition();
  } catch (...) {
    return Status::refused(thrown_text());
  }
}

template <class T>
bool contains(const std::vector<T>& list, const T& item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

inline constexpr const char* kFallback = ".fallback_controllers";  // the manager's parameter, after a name

// One controller with its environment. Members are destroyed in reverse order: the controller
// before its node.
struct LoadedController {
  std::string name, type;
  std::unique_ptr<Node> node;
  ParameterOverrides overrides;
  ControllerContext context;
  std::unique_ptr<Controller> controller;
  ControllerState state = ControllerState::unconfigured;
  Publisher<lifecycle_msgs::msg::TransitionEvent> transitions;
  int ticks_per_update = 1;
  int ticks_to_update = 1;
  Duration period{};
  Duration housekeeping_period{};
  Time next_housekeeping{};
  std::vector<std::string> commands, states;  // full names it requires; valid once configured
  std::vector<std::string> fallback;          // controllers to start if its hardware fails
  std::vector<std::string> references;        // full names of its reference interfaces
  bool chained = false;                       // an active one commands them
  LoopExceptionText thrown{};                 // by its update(), until it is handled between two cycles
};

// The state that ControllerManager::save() writes.
struct SavedManager {
  struct One {
    std::string name, type;
    ControllerState state = ControllerState::unconfigured;
    bool is_saved = false;  // it implements Controller::save()
    int ticks_to_update = 1;
    Time next_housekeeping{};
    SavedSlot run;
  };
  Time now{}, next_diagnostics{};
  std::vector<One> controllers;
  SavedResources resources;
  JointLimiter::Saved limits;
  bool stopped = false;
  std::vector<std::string> stopped_controllers;
};

struct ControllerManager::Impl {
  Impl(Bus& bus, const Model& model, const ControllerRegistry& registry, const ParameterFile* file,
       ControllerManagerOptions options, const Log& log, Diagnostics& diagnostics);
  ~Impl();

  // -- manager_parameters.cpp
  void read_own_parameters(Diagnostics& diagnostics);
  void report_unused_sections(Diagnostics& diagnostics) const;
  [[nodiscard]] std::vector<std::string> texts_of(const std::string& parameter);
  [[nodiscard]] NodeArguments arguments_of(const std::string& name, const std::string& full_name);
  [[nodiscard]] ParameterOverrides overrides_of(const LoadedController& c, const NodeArguments& arguments);
  [[nodiscard]] std::filesystem::path params_file(const std::string& name, const std::string& text) const;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> declared() const;

  // -- controller_manager.cpp
  [[nodiscard]] LoadedController* find(std::string_view name) const;
  LoadedController& at(std::string_view name) const;  // throws InputError with the nearest name
  void load(const std::string& name, const std::string& type);
  std::unique_ptr<LoadedController> make(const std::string& name, const std::string& type,
                                         const NodeArguments& arguments);
  // The place of its type in the manager's section.
  [[nodiscard]] SourceLocation where_written(const std::string& name, const std::string& type) const;
  void report_type_of_other_distro(const std::string& type, SourceLocation where) const;
  // Sets the bus's name rules of a controller, instead of its former ones.
  void use_rules(const std::string& controller, const std::vector<std::string>& rules);
  void declare_written_type(LoadedController& loaded);
  [[nodiscard]] std::string type_of(const std::string& name);
  void choose_rate(LoadedController& loaded);
  void configure(LoadedController& loaded);  // throws InputError
  Status configure(const std::string& name);
  Status cleanup(const std::string& name);
  Status unload(const std::string& name);
  void tick(Time now);
  void housekeeping(Time now);
  void publish_state(Time now);

  // -- manager_switch.cpp
  void change_state(LoadedController& c, ControllerState to);
  struct Plan {
    std::vector<LoadedController*> stop, start;
    std::vector<std::string> problems;   // sentences: what a best-effort switch leaves out
    std::vector<std::string> conflicts;  // sentences: why there is no switch, strict or not
  };
  [[nodiscard]] Plan plan(std::span<const std::string> activate, std::span<const std::string> deactivate,
                          Strictness strictness) const;
  void plan_claims(Plan& plan) const;
  // Why required interfaces are not available once the plan is carried out; empty: all are available.
  [[nodiscard]] std::string missing_interface(const LoadedController& loaded, const Plan& plan,
                                              std::string* full_name = nullptr) const;
  // nothing_to_do: output of a switch that is not refused; true if everything is already as requested or
  // is left out.
  Status switch_controllers(std::span<const std::string> activate, std::span<const std::string> deactivate,
                            Strictness strictness, bool* nothing_to_do = nullptr);
  Status carry_out(const Plan& plan, Strictness strictness);
  void deactivate(LoadedController& loaded);
  // Deactivates the controllers and writes their last commands; returns the interfaces whose claims end.
  std::vector<std::string> stop_and_write(const std::vector<LoadedController*>& controllers);
  Status activate(LoadedController& loaded, std::span<const std::string> handed_over);
  void release(LoadedController& loaded);
  void roll_back(const std::vector<LoadedController*>& ran_before);
  void note_active();
  void restart(Time now);
  void restart(const std::vector<LoadedController*>& again);
  void start_again(const std::vector<LoadedController*>& again, const std::vector<std::string>& commands);

  // -- manager_chain.cpp
  void offer_references(LoadedController& loaded);
  void withdraw_references(LoadedController& loaded);
  // True if `leader` commands a reference interface of `follower`.
  [[nodiscard]] static bool commands_reference(const LoadedController& leader,
                                               const LoadedController& follower);
  enum class ChainOrder { leaders_first, followers_first };
  // The same controllers, in their order except for chains.
  [[nodiscard]] static std::vector<LoadedController*> ordered(const std::vector<LoadedController*>& all,
                                                              ChainOrder order);
  // `followers` and all controllers that command one of their references, directly or through a chain.
  [[nodiscard]] std::vector<LoadedController*> with_leaders(std::vector<LoadedController*> followers) const;
  // Why `follower` cannot stop; empty: it can.
  [[nodiscard]] std::string running_leader(const LoadedController& follower, const Plan& plan) const;
  void set_chained_modes();
  [[nodiscard]] std::vector<controller_manager_msgs::msg::ChainConnection> chain_connections(
      const LoadedController& leader) const;

  // -- manager_diagnostics.cpp
  void serve_diagnostics();
  void publish_diagnostics();
  void describe_controllers(diagnostic_msgs::msg::DiagnosticStatus& status) const;
  void describe_hardware(diagnostic_msgs::msg::DiagnosticStatus& status) const;
  void describe_manager(diagnostic_msgs::msg::DiagnosticStatus& status) const;

  // -- manager_start.cpp
  void start(std::span<const std::string> names);
  void start_compatible(std::span<const std::string> names);
  // Loads and configures the controller; nullptr with a warning if that fails.
  LoadedController* try_to_load(const std::string& name);
  void leave_out(const std::string& name, const std::vector<Diagnostic>& why);
  void report_left_out(std::span<const std::string> names);
  // The loaded controllers that can be active together; leaves the others out, or inactive.
  std::vector<std::string> compatible_of(std::vector<LoadedController*> wanted);
  void check_start(const std::vector<LoadedController*>& wanted) const;  // throws InputError
  // The place of the interface's joint in the controller's YAML, or else the file.
  [[nodiscard]] SourceLocation place_of_interface(const LoadedController& loaded,
                                                  const std::string& full_name) const;

  // -- manager_services.cpp
  void serve();
  void serve_lists();
  void serve_life_cycle();
  void publish_activity();

  // -- manager_hardware_services.cpp
  void serve_hardware();

  // -- manager_hardware.cpp
  Status add_hardware(std::unique_ptr<HardwareComponent> hardware, const HardwareDescription& description,
                      Diagnostics& diagnostics);
  ResourceTable::Component& initialise_hardware(std::unique_ptr<HardwareComponent> hardware,
                                                const HardwareDescription& description,
                                                Diagnostics& diagnostics);
  Status set_hardware_state(const std::string& name, HardwareState target);
  Status without_drives(const std::string& name, const char* during,
                        const std::function<Status(HardwareComponent&)>& call);
  Status release_joint(const JointRelease& release);
  Status pass_towards(ResourceTable::Component& component, HardwareState target);
  Status pass(ResourceTable::Component& component, HardwareState next, const char* participle,
              const std::function<Status()>& transition);
  void enter_error(ResourceTable::Component& component, const std::string& why);
  void note_fault(ResourceTable::Component& component, const std::string& why);
  void settle(Time now);
  void settle(ResourceTable::Component& component, const HardwareFault& fault);
  void settle_controllers();
  void report_not_finite();
  void deactivate_all(const std::vector<LoadedController*>& controllers);
  void start_fallbacks(const std::vector<LoadedController*>& failed);
  void shut_down_hardware();
  void make_hardware_node(const std::string& component);

  // -- manager_stop.cpp
  void serve_stop();
  void stop(const std::string& by);
  void stop_component(ResourceTable::Component& component);
  void forget_commands(ResourceTable::Component& component);
  Status reset_stop();

  // -- manager_saving.cpp
  Status save(SavedManager& out) const;
  [[nodiscard]] std::vector<std::string> differences(const SavedManager& saved) const;
  bool restore_hardware(const SavedManager& saved);
  bool restore_switches(const SavedManager& saved, Time now);
  void restore_values(const SavedManager& saved, Time now);
  void restart_unsaved(const SavedManager& saved, Time now);

  Bus& bus;
  const Model* model;
  const ControllerRegistry& registry;
  const ParameterFile* file;
  ControllerManagerOptions options;
  const Log& log;
  Node node;
  ParameterOverrides own;  // overrides of the manager's node
  Duration period{};
  Time now{};
  ResourceTable resources;
  std::map<std::string, std::unique_ptr<Node>> hardware_nodes;  // by component
  JointLimiter limiter;
  GuardedCommands guarded;
  std::vector<std::unique_ptr<LoadedController>>
      loaded;  // in order of loading, which is the order of updates
  std::vector<LoadedController*> active;
  bool controller_failed = false;                            // an update() has thrown
  std::vector<std::pair<std::string, Diagnostic>> left_out;  // names and reasons in the present start
  bool stopped = false;                                      // the emergency stop is latched
  std::vector<std::string> stopped_controllers;              // by it; a reset activates them again
  Publisher<controller_manager_msgs::msg::ControllerManagerActivity> activity;
  Publisher<std_msgs::msg::Bool> stop_topic;
  Publisher<diagnostic_msgs::msg::DiagnosticArray> diagnostics_topic;
  diagnostic_msgs::msg::DiagnosticArray
      diagnostics_message;  // kept from the last publication, to reuse its memory
  Time next_diagnostics{};
  std::optional<LoopStatistics> loop;  // of a loop with a separate thread
};

}  // namespace doppel
