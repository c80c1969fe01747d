#pragma once
// The controller manager with its hardware, for one robot. It shares the model and has a copy of the YAML, so
// that another machine with the same structure can replace the first one under running controllers.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/control/manager/controller_manager.h"
#include "doppel/devices/emulated_robot/stepped_device.h"
#include "doppel/devices/topic_driver/topic_hardware.h"
#include "doppel/export.h"
#include "doppel/scenario/compile/compiled_robot.h"
#include "doppel/scenario/compile/simulated_hardware.h"
#include "doppel/scenario/schema/scenario.h"
#include "doppel/twin/loop/collision_guard.h"

namespace doppel {

// A controller that no file declares, for joints without another controller.
struct GeneratedController {
  std::string name, type;
  std::vector<std::string> joints;                                           // empty: it commands nothing
  std::vector<std::pair<std::string, std::vector<std::string>>> parameters;  // in addition to `joints`
};

// Which controllers are to be active, and which only loaded and configured.
struct ControllerSelection {
  std::vector<std::string> active, inactive;
  std::vector<std::string> declared;  // in their YAML
  // The user did not choose them: those that do not fit are left out, and joints without a
  // controller are held.
  bool only_compatible = false;
  // State before an edit, which is kept: generated controllers that were inactive, and joints that could be
  // held and had no controller.
  std::vector<GeneratedController> idle;
  std::vector<std::string> released;
  bool stopped = false;  // the emergency stop is on
};

// The period for a rate in Hz in whole physics steps, with a warning at `where` if it is rounded.
DOPPEL_API Duration period_in_steps(double rate, Duration step, const SourceLocation& where,
                                    Diagnostics& diagnostics);

class DOPPEL_API ControlStack {
 public:
  // The registered plugins, and how they are used.
  struct Options {
    const ControllerRegistry& controllers;
    const HardwareRegistry& hardware;  // the simulated hardware is added to a copy
    bool enforce_limits = true;
    HardwareUse use = HardwareUse::simulated;
    EmulationOptions emulation = {};  // of emulated hardware and of ports
    bool guard = false;               // commands of devices are checked by the geometry (collision_guard.h)
    std::vector<KeepOutBox> keep_out = {};
    bool rehearses = false;  // trajectories of devices first run in a copy of the twin (rehearser.h)
    std::function<std::span<const double>()> present_q = {};  // of the robot, measured where it is
    bool rehearsal = false;  // real hardware is simulated, because the running machine has its ports open
    // Devices that are not in their initial state are an error. False: the robot runs already, and they are
    // reported in the log.
    bool must_start = false;
    RigOptions sensors = {};
    std::shared_ptr<const EarthFrame> earth = std::make_shared<EarthFrame>();  // of the present world
    std::shared_ptr<RangeValues> ranges =
        nullptr;                           // of the twin's range sensors; nullptr: they are not measured
    const ControlStack* former = nullptr;  // whose sensors' start and noise continue
  };
  // Throws InputError for errors in the YAML or the interfaces. Each component of the description is made by
  // the type that is registered for its plugin name, or simulated, with a note, if there is none. Throws
  // UnavailableError with `must_start`, and where an argument selects hardware that has no driver here.
  ControlStack(Bus& bus, const CompiledRobot& machine, Instance instance, const Options& options,
               const Log& log, Diagnostics& diagnostics);

  // Throws InputError; nothing is active then. With `selection.only_compatible` nothing is refused: a
  // joint_state_broadcaster is added if there is none, and a joint_trajectory_controller for the joints with
  // position commands and without a controller, except `selection.released`, with a note.
  // With hardware that waits for its first states, or for a person, the controllers start in attend().
  void start(const ControllerSelection& selection, const Log& log);
  // Between steps: activates hardware that has what it waited for, and starts the controllers.
  void attend(const Log& log);
  // The components for which the controllers wait.
  [[nodiscard]] std::vector<std::string> awaited() const;
  // All controllers of the YAML active, or, if some are named, those active and the others inactive; of a
  // robot with choices exactly these.
  [[nodiscard]] ControllerSelection selection_of(const CompiledRobot& machine) const;
  // The controllers that no file declares, as YAML.
  [[nodiscard]] std::string generated_yaml() const;
  // The present state of the controllers.
  [[nodiscard]] ControllerSelection present_selection() const;

  // A component is not simulated and needs a ControlLoop in wall-clock time.
  [[nodiscard]] bool has_real_hardware() const { return real_; }
  [[nodiscard]] bool has_emulated_devices() const { return !stepped_.empty(); }
  [[nodiscard]] bool has_generated() const { return !generated_.empty(); }

  // Replaces the machine by one with the same structure; drives and claims continue in its instance.
  void take_over(const CompiledRobot& machine, Instance now);
  // Carries over the references of position drives on their way to their targets.
  void carry_references(const Instance& before, Instance now) const;
  // The same instance under another handle.
  void rebind(Instance instance);
  // Between steps: the state was reset: it is that of the start for the sensors.
  void restart_sensors();
  // Between steps: the state was written; the sensors keep their start and their noise.
  void state_written();
  // Between steps: the hand at emulated devices brings a joint to this position (rad or m). False: there is
  // none, or no such joint.
  bool guide(std::string_view joint, double position);

  // -- in the loop
  void before_step();
  void after_step();
  // `hash` with the present values of the sensors that controllers read.
  [[nodiscard]] std::uint64_t with_sensors(std::uint64_t hash) const;

  [[nodiscard]] ControllerManager& manager() { return *manager_; }
  [[nodiscard]] const ControllerManager& manager() const { return *manager_; }
  [[nodiscard]] const Model& model() const { return *model_; }
  // Why state interfaces of sensors read none (bind_sensors()), with the name of the component.
  struct Unbound {
    std::string component;
    Diagnostic finding;
  };
  [[nodiscard]] const std::vector<Unbound>& unbound() const { return unbound_; }

 private:
  static constexpr const char* kManager = "controller_manager";  // of log lines

  // True: a component of the machine will not be simulated.
  static bool has_device(const CompiledRobot& machine, const Options& options);
  static HardwareRegistry types_for(Bus& bus, const CompiledRobot& machine, Instance instance,
                                    const Options& options);
  void add_hardware(Bus& bus, const CompiledRobot& machine, Instance instance, const Options& options,
                    const Log& log, Diagnostics& diagnostics);
  void add_component(const CompiledRobot& machine, HardwareDescription description,
                     const HardwareRegistry::Type& type, bool must_start, const Log& log,
                     Diagnostics& diagnostics);
  // A component that is not in its initial state, for the reason `why`.
  void note_refusal(const HardwareComponent& component, const HardwareDescription& description,
                    const std::string& why, bool must_start, const Log& log);
  [[nodiscard]] HardwareState state_of(const std::string& component) const;
  void resume_sensors(const ControlStack& former);
  void use_sensors(SimulatedHardware& hardware, const HardwareDescription& description,
                   const CompiledRobot& machine);
  void hold_unclaimed_joints(const ControllerSelection& selection, const Log& log);
  void start_spare_base(const ControllerSelection& selection, const Log& log);
  void hold(GeneratedController wanted, const Log& log);
  // Makes it as it was before an edit, with its remaining joints.
  void make_idle(GeneratedController idle, const Log& log);
  // True if it is now active, or inactive as requested; a warning has the reason otherwise.
  bool make(const GeneratedController& controller, bool active, const Log& log);

  // The second one is the model with which the hardware was initialised, which may keep pointers to it.
  std::shared_ptr<const Model> model_, first_model_;
  ParameterFile controllers_;
  bool named_;                            // by the user
  std::vector<std::string> free_joints_;  // RobotSetup::free_joints
  std::optional<GeneratedBase> spare_base_;
  bool only_compatible_ = false;  // of the selection of start()
  std::vector<GeneratedController> generated_;
  std::vector<std::string> left_out_;      // declared in the file; after an edit they are tried again
  std::unique_ptr<CollisionGuard> guard_;  // nullptr: none
  std::unique_ptr<ControllerManager> manager_;
  struct Simulated {
    SimulatedHardware* hardware;
    HardwareDescription description;
  };
  std::vector<Simulated> simulated_;
  std::vector<SteppedDevice*> stepped_;  // of emulated hardware
  struct Awaited {
    const HardwareComponent* hardware;
    std::string name;
    bool failed = false;  // its activation, which is not tried again
  };
  std::vector<Awaited> awaited_;                // since the start
  std::optional<ControllerSelection> waiting_;  // for them
  std::vector<Diagnostic> absent_;              // devices that were asked for and are not there
  std::vector<Unbound> unbound_;
  RigOptions sensor_options_;
  std::shared_ptr<const EarthFrame> earth_;
  std::shared_ptr<RangeValues> ranges_;
  bool real_ = false;
};

}  // namespace doppel
