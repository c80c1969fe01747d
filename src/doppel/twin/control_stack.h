#pragma once
// The controller manager with its hardware, for one robot. It shares the model and has a copy of the YAML, so
// that another machine with the same structure can take the first one's place under running controllers.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doppel/control/controller_manager.h"
#include "doppel/export.h"
#include "doppel/twin/compiled_robot.h"
#include "doppel/twin/simulated_hardware.h"

namespace doppel {

// A controller that no file declares, over joints that nothing else drives.
struct GeneratedController {
  std::string name, type;
  std::vector<std::string> joints;                                           // none: it commands nothing
  std::vector<std::pair<std::string, std::vector<std::string>>> parameters;  // beside `joints`
};

// Which controllers are to be active, and which only loaded and configured.
struct ControllerSelection {
  std::vector<std::string> active, inactive;
  std::vector<std::string> declared;  // in the YAML that they come from
  // Nobody chose them: what does not fit is left out, and what no controller drives is held where it is.
  bool only_compatible = false;
  // Before an edit: generated controllers that were switched off, and joints that could be held and that
  // nothing drove. Both stay as they were.
  std::vector<GeneratedController> idle;
  std::vector<std::string> released;
  bool stopped = false;  // the emergency stop is on
};

// The period for a rate in Hz in whole physics steps; what has to be rounded is a warning at `where`.
DOPPEL_API Duration period_in_steps(double rate, Duration step, const SourceLocation& where,
                                    Diagnostics& diagnostics);

class DOPPEL_API ControlStack {
 public:
  // What plugins offer, and what of it is wanted.
  struct Options {
    const ControllerRegistry& controllers;
    const HardwareRegistry& hardware;  // the simulation's own are added to them
    bool enforce_limits = true;
    bool rehearsal = false;  // real hardware is simulated: its ports belong to the machine that runs
  };
  // Throws InputError for what is wrong in the YAML or among the interfaces. Each component of the
  // description is made by what is registered for its plugin's name, and simulated where nothing is; a note
  // says so.
  ControlStack(Bus& bus, const CompiledRobot& machine, Instance instance, const Options& options,
               const Log& log, Diagnostics& diagnostics);

  // Throws InputError; nothing is active then. Where `wish.what_fits`, nothing is refused: a
  // joint_state_broadcaster is added where none runs, and a joint_trajectory_controller over the joints that
  // take positions and that no controller drives, but for `wish.released`, with a note.
  void start(const ControllerSelection& selection, const Log& log);
  // All that the YAML declares, or what `activate` names and the rest inactive.
  [[nodiscard]] ControllerSelection selection_of(const std::vector<std::string>& activate) const;
  // What runs now.
  [[nodiscard]] ControllerSelection present_selection() const;

  // Some component is not a simulation: it wants a loop by the wall clock.
  [[nodiscard]] bool has_real_hardware() const { return real_; }
  [[nodiscard]] bool has_generated() const { return !generated_.empty(); }

  // The machine has the same structure as the one before; drives and claims go on in its instance.
  void take_over(const CompiledRobot& machine, Instance now);
  // References of drives that hold a position, on their way to their targets.
  void carry_references(const Instance& before, Instance now) const;
  // The same instance under another handle.
  void rebind(Instance instance);

  [[nodiscard]] ControllerManager& manager() { return *manager_; }
  [[nodiscard]] const ControllerManager& manager() const { return *manager_; }
  [[nodiscard]] const Model& model() const { return *model_; }

 private:
  void add_hardware(const CompiledRobot& machine, Instance instance, const Options& options,
                    Diagnostics& diagnostics);
  void hold_unclaimed_joints(const ControllerSelection& selection, const Log& log);
  void hold(GeneratedController wanted, const Log& log);
  // As it was before an edit, with those of its joints that are still there.
  void make_idle(GeneratedController idle, const Log& log);
  // Whether it runs now, or is inactive where it is not to be active; a warning says why not.
  bool make(const GeneratedController& controller, bool active, const Log& log);

  // The second one is what the hardware was initialised with, which may point to it forever.
  std::shared_ptr<const Model> model_, first_model_;
  ParameterFile controllers_;
  bool named_;                    // by the user
  bool only_compatible_ = false;  // of the wish that it was started with
  std::vector<GeneratedController> generated_;
  std::vector<std::string> left_out_;  // that the file declares; after an edit they are tried again
  std::unique_ptr<ControllerManager> manager_;
  std::vector<SimulatedHardware*> simulated_;
  bool real_ = false;
};

}  // namespace doppel
