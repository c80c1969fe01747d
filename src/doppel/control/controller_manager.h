#pragma once
// The controller manager: hardware's interfaces, exclusive claims, the controllers' life cycle, and the tick
// read - update - enforce limits - write. Everything but tick() runs between steps on the loop's thread.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "doppel/bus/parameter_file.h"
#include "doppel/control/controller.h"
#include "doppel/control/hardware.h"
#include "doppel/export.h"

namespace doppel {

enum class ControllerState { unconfigured, inactive, active };
DOPPEL_API std::string_view to_string(ControllerState state);

enum class Strictness { best_effort = 1, strict = 2 };  // controller_manager_msgs/srv/SwitchController

struct ControllerManagerOptions {
  std::string name = "controller_manager";
  std::string name_space;    // "/left": of its node and its controllers'; empty: none
  double update_rate = 100;  // Hz, used where the YAML does not specify it
  // The period that the loop can keep for an update rate in Hz that was written at a place; what it has to
  // round it warns of. Empty: exactly that of the rate.
  std::function<Duration(double rate, const SourceLocation& where, Diagnostics& diagnostics)> choose_period =
      {};
  bool enforce_limits = true;
};

// What the YAML specifies of a loop with a thread of its own, by ros2_control's names.
struct LoopSettings {
  int thread_priority = 50;  // SCHED_FIFO
  bool lock_memory = true;
};

// Of a loop with a thread of its own (control_loop.h), since it began.
struct LoopStatistics {
  std::uint64_t ticks = 0, overruns = 0;  // overruns: ticks that ended after the next one was due
  double rate = 0;                        // Hz, mean of the last second
  double rate_deviation = 0;              // Hz, standard deviation of the same
  double execution = 0, longest = 0;      // s, of a tick: mean of the last second; longest of all
};

struct ControllerView {
  std::string name, type;
  ControllerState state = ControllerState::unconfigured;
  double update_rate = 0;
  std::vector<std::string> claimed;  // command interfaces it holds now
  std::vector<std::string> required_commands, required_states;
  std::vector<std::string> references;  // that it offers to others, "joint/position"; empty: not chainable
  bool chained = false;                 // another controller commands them
};

struct HardwareView {
  std::string name, type, plugin;
  HardwareState state = HardwareState::unconfigured;
  std::string fault;  // why it is not active; empty: nothing has failed
};

struct InterfaceView {
  std::string full_name;
  bool available = true;
  std::string claimed_by;  // empty: nobody
};

class DOPPEL_API ControllerManager {
 public:
  // `file` may be null: no controllers are known. The model outlives the manager, or model_changed() names
  // another one before it goes. Throws InputError for bad values in the manager's own section.
  ControllerManager(Bus& bus, const Model& model, const ControllerRegistry& registry,
                    const ParameterFile* file, ControllerManagerOptions options, const Log& log,
                    Diagnostics& diagnostics);
  ~ControllerManager();

  // Initialises the component and brings it to the state that the YAML wants it to start in: active where it
  // says nothing. Throws InputError for what on_init refuses and for an interface that is offered already;
  // what refuses later is logged.
  void add_hardware(std::unique_ptr<HardwareComponent> hardware, const HardwareDescription& description,
                    Diagnostics& diagnostics);

  // The controllers that the file declares (name and type), in its order.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> declared_controllers() const;

  // Life cycle, as the services do it. load throws InputError for what is wrong in the YAML (unknown type
  // with the nearest, unknown joint with the nearest, at file:line:column).
  void load(const std::string& name, const std::string& type = "");
  Status configure(const std::string& name);
  Status switch_controllers(std::span<const std::string> activate, std::span<const std::string> deactivate,
                            Strictness strictness);
  Status unload(const std::string& name);
  // Loads, configures and activates `names` (broadcasters first). Throws InputError, with both places in the
  // YAML, where two of them claim one interface; nothing is active then.
  void start(std::span<const std::string> names);
  // The same of a file that the user did not name: what cannot be loaded, configured or have its interfaces
  // is left out with a warning and not loaded; of two that claim one interface the trajectory controller,
  // else the first one, is active and the other inactive, with a note.
  void start_compatible(std::span<const std::string> names);

  // In the loop, once every period(). No allocation, no lock, no throw.
  [[nodiscard]] Duration period() const;
  [[nodiscard]] LoopSettings loop_settings() const;
  void tick(Time now);
  // Between ticks, after each: deals with what has failed in it. Costs one load where nothing has.
  void settle(Time now);
  // Between steps.
  void housekeeping(Time now);
  // Between steps: reads the hardware and lets broadcasters publish it, so that who looks at a machine whose
  // time stands sees it as it is.
  void publish_state(Time now);
  // After a reset of the simulation: deactivates and activates again what is active, so that everything holds
  // where it is.
  void restart(Time now);

  // Between steps: another model with the same joints takes the place of the one before; controllers, claims
  // and trajectories go on, limits are the new ones.
  void model_changed(const Model& model);

  // The emergency stop, latched until it is reset: hardware brings its joints to rest and holds them,
  // whatever commands them; controllers that command are deactivated and none can be activated. A reset
  // activates them again, without what they were doing. `by`: who stops, for the log.
  void stop(const std::string& by);
  Status reset_stop();
  [[nodiscard]] bool is_stopped() const;
  // What a reset would activate again.
  [[nodiscard]] const std::vector<std::string>& stopped_controllers() const;

  [[nodiscard]] std::vector<ControllerView> controllers() const;
  [[nodiscard]] std::vector<HardwareView> hardware() const;
  [[nodiscard]] std::vector<InterfaceView> command_interfaces() const;
  [[nodiscard]] std::vector<InterfaceView> state_interfaces() const;
  // The last command on "joint/position" and the like; NaN: none.
  [[nodiscard]] double command(std::string_view full_name) const;
  [[nodiscard]] double state(std::string_view full_name) const;
  // What an active chainable controller follows for "joint/position"; NaN: none does.
  [[nodiscard]] double reference(std::string_view interface) const;

  // Any thread: on_stall() of every component.
  void stall_hardware() noexcept;
  // How a loop of its own keeps its time, for /diagnostics; between ticks.
  void report_loop(const LoopStatistics& statistics);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
