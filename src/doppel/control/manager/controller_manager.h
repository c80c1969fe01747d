#pragma once
// The controller manager: hardware's interfaces, exclusive claims, the controllers' life cycle, and the tick
// read - update - enforce limits - write. All functions but tick() and stall_hardware() are called between
// ticks on the loop's thread or, with a ControlLoop, on the thread that holds its gate.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/lateness_histogram.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/controller.h"
#include "doppel/control/manager/soft_limits.h"
#include "doppel/export.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel {

enum class ControllerState { unconfigured, inactive, active };
DOPPEL_API std::string_view to_string(ControllerState state);

enum class Strictness { best_effort = 1, strict = 2 };  // controller_manager_msgs/srv/SwitchController

struct ControllerManagerOptions {
  std::string name = "controller_manager";
  std::string name_space;    // "/left": of its node and its controllers'; empty: none
  double update_rate = 100;  // Hz, used where the YAML does not specify it
  // Returns the period that the loop can keep for an update rate (Hz) written at `where`, with a warning if
  // it is rounded. Empty: the exact period of the rate.
  std::function<Duration(double rate, const SourceLocation& where, Diagnostics& diagnostics)> choose_period =
      {};
  bool enforce_limits = true;
  CommandGuard* guard = nullptr;  // of position commands; outlives the manager. nullptr: none
};

// The YAML's settings of a loop with a separate thread, by ros2_control's names.
struct LoopSettings {
  int thread_priority = 50;  // SCHED_FIFO
  bool lock_memory = true;
};

// Statistics of a loop with a separate thread (control_loop.h), since its start.
struct LoopStatistics {
  std::uint64_t ticks = 0, overruns = 0;  // overruns: ticks that ended after the next one was due
  double rate = 0;                        // Hz, mean of the last second
  double rate_deviation = 0;              // Hz, standard deviation of the rate in that second
  double execution = 0, longest = 0;      // s, of a tick: mean of the last second; longest since the start
  LatenessHistogram lateness;             // from a tick's due time until its commands are written
};

struct ControllerView {
  std::string name, type;
  ControllerState state = ControllerState::unconfigured;
  double update_rate = 0;            // Hz
  std::vector<std::string> claimed;  // command interfaces that it holds now
  std::vector<std::string> required_commands, required_states;
  std::vector<std::string> references;  // reference interfaces, "joint/position"; empty: not chainable
  bool chained = false;                 // another controller commands the references
};

struct HardwareView {
  std::string name, type, plugin;
  HardwareState state = HardwareState::unconfigured;
  std::string fault;  // the reason why it is not active; empty: nothing has failed
};

struct InterfaceView {
  std::string full_name;
  bool available = true;
  std::string claimed_by;  // name of a controller; empty: not claimed
};

class DOPPEL_API ControllerManager {
 public:
  // `file` may be nullptr: no controllers are declared. The model outlives the manager, or is replaced by
  // model_changed() before it is destroyed. Throws InputError for invalid values in the manager's section.
  ControllerManager(Bus& bus, const Model& model, const ControllerRegistry& registry,
                    const ParameterFile* file, ControllerManagerOptions options, const Log& log,
                    Diagnostics& diagnostics);
  ~ControllerManager();

  // Initialises the component and brings it to its initial state of the YAML, by default active. Refused with
  // the reason: it is added and has not reached that state. Throws InputError if on_init refuses and for an
  // interface that already exists.
  Status add_hardware(std::unique_ptr<HardwareComponent> hardware, const HardwareDescription& description,
                      Diagnostics& diagnostics);

  // The controllers that the file declares (name and type), in its order.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> declared_controllers() const;

  // Life cycle as in the services; failures are a refused Status with the reason. load throws InputError for
  // errors in the YAML (unknown type or joint with the nearest name, at file:line:column).
  void load(const std::string& name, const std::string& type = "");
  Status configure(const std::string& name);
  Status switch_controllers(std::span<const std::string> activate, std::span<const std::string> deactivate,
                            Strictness strictness);
  Status unload(const std::string& name);
  // Loads, configures and activates `names` (broadcasters first). Throws InputError if one of them cannot be
  // started, and with both places in the YAML if two of them claim one interface; none is active then.
  void start(std::span<const std::string> names);
  // The same for a file that the user did not name: a controller that cannot be loaded, configured or get its
  // interfaces is left out with a warning; of two that claim one interface the trajectory controller, else
  // the first one, is activated and the other stays inactive, with a note.
  void start_compatible(std::span<const std::string> names);

  [[nodiscard]] Duration period() const;  // between ticks
  [[nodiscard]] LoopSettings loop_settings() const;
  // In the loop, once every period(). No allocation, no lock, no throw.
  void tick(Time now);
  // Between ticks, after each: handles the failures of the tick. Costs one load if there is none.
  void settle(Time now);
  // Between steps: reports, results and diagnostics of everything that is due.
  void housekeeping(Time now);
  // Between steps: reads the hardware and lets broadcasters publish it, so that clients see the present state
  // while simulated time is paused.
  void publish_state(Time now);
  // After a reset of the simulation: deactivates and reactivates the active controllers, so that each holds
  // the present position.
  void restart(Time now);

  // Between steps: replaces the model by another one with the same joints. Controllers, claims and
  // trajectories continue under the new limits.
  void model_changed(const Model& model);
  // Between steps: the soft limits of joints, in place of the former ones.
  void set_soft_limits(std::vector<SoftLimits> limits);

  // The emergency stop, latched until it is reset: hardware brings its joints to rest and holds them,
  // regardless of commands; commanding controllers are deactivated and none can be activated. A reset
  // activates them again, without their former goals. `by`: the source of the stop, for the log.
  void stop(const std::string& by);
  Status reset_stop();
  [[nodiscard]] bool is_stopped() const;
  // The controllers that a reset would activate again.
  [[nodiscard]] const std::vector<std::string>& stopped_controllers() const;

  [[nodiscard]] std::vector<ControllerView> controllers() const;
  [[nodiscard]] std::vector<HardwareView> hardware() const;
  // The report of one of hardware(). False: it is no device with something to report.
  [[nodiscard]] bool report(std::size_t component, DeviceReport& out) const;
  // See the service set_hardware_component_state. Refused while a controller uses the component.
  Status set_hardware_state(const std::string& component, HardwareState target);
  // See HardwareComponent. Refused with the reason, also while the component is active.
  Status relax_hardware(const std::string& component);
  // See JointRelease. Refused with the reason, also during an emergency stop.
  Status release_joint(const JointRelease& release);
  Status confirm_pose(const std::string& component,
                      std::span<const std::pair<std::string, double>> positions);
  [[nodiscard]] std::vector<InterfaceView> command_interfaces() const;
  [[nodiscard]] std::vector<InterfaceView> state_interfaces() const;
  // The last command or the present state of an interface such as "joint/position", in its unit
  // (hardware.h); NaN: none.
  [[nodiscard]] double command(std::string_view full_name) const;
  [[nodiscard]] double state(std::string_view full_name) const;
  // True: there is this state interface, and its hardware reads it, because it is at least inactive.
  [[nodiscard]] bool is_read(std::string_view state_interface) const;
  // The transform of the robot's root link that an active controller publishes; nullptr: none does.
  [[nodiscard]] const BaseTransform* base_transform() const;
  // The value that an active controller follows for "joint/position"; NaN: there is none. Does not allocate.
  [[nodiscard]] double reference(std::string_view interface) const;

  // -- saved states, between ticks
  // Writes hardware, claims, commands, limits and the run state of every controller into the slot, whose
  // memory it reuses. Refused with the names of components that cannot be saved.
  Status save(SavedSlot& slot) const;
  // Active controllers that do not implement Controller::save().
  [[nodiscard]] static std::vector<std::string> unsaved_controllers(const SavedPart& saved);
  // Why the saved state does not fit, a sentence for each difference; empty: it fits.
  [[nodiscard]] std::vector<std::string> differences(const SavedPart& saved) const;
  // Activates and deactivates controllers and hardware, which changes drives, until the same ones are
  // active as then. Goals of those that stop are aborted. True: something was switched.
  bool restore_switches(const SavedPart& saved, Time now);
  // Then: every value becomes that of the saved state. May be called twice.
  void restore_values(const SavedPart& saved, Time now);
  // Last: reactivates the controllers that could not be saved, so that they hold the present position.
  void restart_unsaved(const SavedPart& saved, Time now);

  // Any thread: calls on_stall() of every component.
  void stall_hardware() noexcept;
  // Any thread: false: no component takes commands, so that nothing moves by them.
  [[nodiscard]] bool has_active_hardware() const noexcept;
  // Between ticks: the statistics of a loop with a separate thread, for /diagnostics.
  void report_loop(const LoopStatistics& statistics);
  // The last report; nullptr: a simulation ticks the manager.
  [[nodiscard]] const LoopStatistics* loop_statistics() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
