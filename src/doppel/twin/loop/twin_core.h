#pragma once
// The core of a twin: robots in one world, in one engine with one clock, and the loop that steps them.
// Everything else of a twin (services, publishers, sensors, spawning, reload) is a part: a Tickable that is
// added to the core, uses its functions, and is called by the loop through the base class alone, so that the
// loop depends on none of them.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/log.h"
#include "doppel/control/manager/control_loop.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/scenario/compile/compiled_scenario.h"
#include "doppel/scenario/schema/scenario.h"
#include "doppel/twin/loop/loop_meter.h"
#include "doppel/twin/loop/scene.h"
#include "doppel/twin/loop/tickable.h"
#include "doppel/twin/loop/time_control.h"
#include "doppel/twin/loop/twin_robot.h"

namespace doppel {

class SavedState;  // saved_state.h

// The inputs of a machine besides files; shared, because a build on another thread may outlive the twin.
struct TwinSources {
  Scenario scenario;
  ControllerRegistry controllers;
  HardwareRegistry hardware;
};

// The running machine as input of a build on another thread.
struct RunningMachine {
  std::shared_ptr<const TwinSources> sources;
  RunningRobots robots;
  std::map<std::string, ControllerSelection> selections;  // by namespace
  std::shared_ptr<const CompiledWorld> world;
};

// A robot that is about to join, compiled on any thread.
struct DOPPEL_API JoiningRobot {
  std::shared_ptr<const CompiledRobot> machine;
  std::shared_ptr<const CompiledWorld> without, with;  // the world before, and the same with this robot

  // Throws InputError.
  void compile_into(std::shared_ptr<const CompiledWorld> world);
};

// Every function runs on the loop's thread, those that are not marked otherwise between steps.
class DOPPEL_API TwinCore {
 public:
  // Throws InputError. The log outlives the core.
  TwinCore(Scenario scenario, const Log& log, Diagnostics& diagnostics);
  TwinCore(const TwinCore&) = delete;
  TwinCore& operator=(const TwinCore&) = delete;

  // -- construction: first parts are added, then the robots start
  void add(std::unique_ptr<Tickable> part) { parts_.add(std::move(part)); }
  // Makes the robots' publishers and starts their controllers. Throws InputError.
  void start();

  // -- the loop
  // In the loop: no allocation, no throw, no lock but hold().
  void step();
  void between_steps();
  // To the start: start poses, at rest; active controllers hold there. `time`: afterwards.
  void reset(Time time = Time{});
  // Between steps: writes the whole state into `out`, whose memory it reuses. Refused: a robot drives real
  // hardware, the physics has diverged, or hardware cannot be saved. `out` is not to be used then.
  Status save(SavedState& out);
  // Between steps: everything becomes as it was. Refused, with every difference by name and without a
  // change: a robot, or after a reload an object, was added or removed, or the structure of a robot is
  // another one.
  Status restore(const SavedState& saved);
  // Publishes the present state, after it was written or time was stepped.
  void publish_state();
  // A part has written the states of these robots, by their instances: controllers hold there.
  void state_written(const std::vector<int>& robots);
  // Instances were added, removed or moved: updates the scene and every handle.
  void renew_handles();
  void require_emulated_devices() const;
  // Locks out the loops of real hardware, including those that start meanwhile; uncontended in a simulation.
  [[nodiscard]] std::unique_lock<LoopGate> hold() { return std::unique_lock(gate_); }
  [[nodiscard]] TwinRobot* find_robot_with_loop() const;  // the first one; nullptr: a simulation

  // -- robots
  [[nodiscard]] TwinRobot* find(std::string_view name_space) const;  // nullptr: none
  // Compiles only if instances were added or removed since the robot was compiled. Throws InputError if its
  // name is taken or its controllers cannot be started; nothing has changed then.
  void add_robot(JoiningRobot& joining);
  Status remove_robot(const std::string& name_space);
  // Throws InputError if its nodes would have the names of those of a robot with another namespace.
  [[nodiscard]] std::unique_ptr<TwinRobot> make_robot(std::shared_ptr<const CompiledRobot> robot,
                                                      const TwinRobot* former, Diagnostics& diagnostics);
  void on_robots_changed(std::function<void()> callback) { robots_changed_ = std::move(callback); }
  void report_robots_changed() const {
    if (robots_changed_) robots_changed_();
  }

  // -- the machine, which a reload exchanges together with the robots
  void exchange_machine(std::unique_ptr<CompiledScenario>& machine);
  [[nodiscard]] const CompiledScenario& machine() const { return *machine_; }
  [[nodiscard]] std::vector<std::unique_ptr<TwinRobot>>& robots() { return robots_; }
  [[nodiscard]] const std::vector<std::unique_ptr<TwinRobot>>& robots() const { return robots_; }
  [[nodiscard]] std::map<std::string, ControllerSelection> present_selections() const;
  [[nodiscard]] std::shared_ptr<const RunningMachine> running() const;

  // -- what the core and its parts share
  [[nodiscard]] Engine& engine() const { return *machine_->engine; }
  [[nodiscard]] Bus& bus() { return bus_; }
  [[nodiscard]] const Log& log() const { return log_; }
  [[nodiscard]] const Scenario& scenario() const { return sources_->scenario; }
  [[nodiscard]] const Scene& scene() const { return scene_; }
  [[nodiscard]] TimeControl& time_control() { return time_control_; }
  [[nodiscard]] const std::shared_ptr<StaticTransforms>& statics() const { return statics_; }
  [[nodiscard]] const std::shared_ptr<EarthFrame>& earth() const { return earth_; }  // of the present world
  [[nodiscard]] const std::shared_ptr<RangeValues>& ranges() const { return ranges_; }

  [[nodiscard]] Time now() const { return machine_->engine->time(); }
  [[nodiscard]] std::uint64_t steps() const { return steps_; }
  // Since the start of the program: a restored state does not set it back.
  [[nodiscard]] std::uint64_t steps_taken() const { return steps_taken_; }
  [[nodiscard]] std::uint64_t state_hash() const;
  [[nodiscard]] const LoopPhases& phases() const { return phases_; }

 private:
  void hash_objects();
  [[nodiscard]] Time control_time() const;
  void follow_wall(Time now);
  [[nodiscard]] std::vector<std::string> differences(const SavedState& saved) const;
  void restore_engine(const SavedState& saved);
  void restore_values(const SavedState& saved);
  void publish_due(Time now);
  // Between steps: what a diverged physics leads to, and that it can step again after a reset.
  void settle_divergence();
  [[nodiscard]] std::string divergence_text() const;
  // Instances may have changed without the core, because users of engine() can spawn objects.
  void notice_instances() {
    if (seen_world_ != machine_->engine->compiled()) renew_handles();
  }

  const std::shared_ptr<TwinSources> sources_;
  const Log& log_;
  Bus bus_;
  const std::shared_ptr<StaticTransforms> statics_;
  const std::shared_ptr<EarthFrame> earth_ = std::make_shared<EarthFrame>();
  const std::shared_ptr<RangeValues> ranges_ = std::make_shared<RangeValues>();
  TimeControl time_control_;
  std::unique_ptr<CompiledScenario> machine_;
  LoopGate gate_;  // protects everything that loops of real hardware use
  Scene scene_;
  std::shared_ptr<const CompiledWorld> seen_world_;  // the one of the handles
  std::vector<std::unique_ptr<TwinRobot>> robots_;
  TickList parts_;

  LoopPhases phases_;
  Time last_wall_{};  // wall-clock time of the last stamp
  std::uint64_t steps_ = 0, steps_taken_ = 0;
  std::uint64_t objects_hash_, gone_hash_;  // gone: of robots that were removed
  bool paused_by_divergence_ = false;
  std::function<void()> robots_changed_;
};

// Throws the InputError of a namespace that another robot has.
[[noreturn]] DOPPEL_API void refuse_taken(const std::string& name_space);

// A rehearsal on a separate bus and in a separate world, in which errors of controllers and publishers occur
// before the running machine is changed. Throws InputError.
DOPPEL_API void rehearse(const CompiledRobot& machine, Instance instance, const TwinSources& sources,
                         const std::function<void(ControlStack&, const Log&)>& start,
                         Diagnostics& diagnostics);

}  // namespace doppel
