#pragma once
// The twin: robots in one world with their controllers, in one engine with one clock. Construction does
// everything that may fail or allocate; step() is the loop's body: read - update - write - step - publish, in
// fixed steps of simulated time. The same inputs give bit-identical results.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/log.h"
#include "doppel/control/manager/control_loop.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/scenario/schema/scenario.h"
#include "doppel/sensors/rigs/light_rig.h"
#include "doppel/twin/assembly/joint_handle.h"
#include "doppel/twin/loop/loop_meter.h"
#include "doppel/twin/loop/twin_robot.h"
#include "doppel/twin/spawn/robot_spawner.h"

namespace doppel {

class SavedState;        // loop/saved_state.h
struct TimeControl;      // loop/time_control.h
struct TwinReplacement;  // reload/twin_reload.h

class DOPPEL_API Twin {
 public:
  // Throws InputError. Warnings and notes go to `diagnostics`; later messages go to `log`, which
  // outlives the twin.
  Twin(const Scenario& scenario, const Log& log, Diagnostics& diagnostics);
  // One robot on the ground with its controllers, by its name or file as for `doppel up`, without a log.
  // Throws InputError.
  explicit Twin(const std::string& target, const XacroArguments& arguments = {});
  ~Twin();
  Twin(const Twin&) = delete;
  Twin& operator=(const Twin&) = delete;

  // -- the loop's thread
  // One physics step, with the controllers' ticks and the publications that are due. No allocation, no throw,
  // no lock but hold().
  void step();
  // between_steps() and step() for this simulated time, rounded to whole steps; ends at a divergence.
  void run_for(Duration time);
  // Between steps: handles messages and requests of edges, sends reports and results. Allocates only if there
  // is something to do.
  void between_steps();
  void reset();  // to the start: time 0, start poses, at rest; active controllers hold there

  // -- saved states (docs/saved_states.md). The loop's thread, between steps.
  // The whole state: engine, controllers, sensors, time. Throws InputError: a robot drives real hardware,
  // the physics has diverged, or a component of hardware cannot be saved.
  [[nodiscard]] std::shared_ptr<const SavedState> save();
  // Continues from it, bit-identically if the files were not edited since. Refused, with each difference by
  // name and without a change, if robots were added or removed since or have another structure.
  Status restore(const SavedState& state);
  // Keeps automatic states of the last 30 s of simulated time, every 0.5 s, for rewind(); by default none
  // are kept.
  void keep_states(bool on);
  // To the newest automatic state that is at least so old; refused if there is none.
  Status rewind(Duration back);

  // Publishes the present /clock, /tf, joint states, loads, contacts and objects, after the state was written
  // or time was stepped, so that clients see it while time is paused.
  void publish_state();
  // Wall-clock time spent in step() so far by controllers and by publishing; the other phases are 0.
  [[nodiscard]] const LoopPhases& step_phases() const;

  // Locks out the loops of real hardware (control_loop.h), which use the bus, the controllers and the
  // hardware from their own threads. The functions above take it themselves; in a simulation it is
  // uncontended. Recursive. The loop's thread.
  [[nodiscard]] std::unique_lock<LoopGate> hold();

  // The running machine as input of prepare_robot() and prepare(), which may outlive the twin; opaque. The
  // loop's thread.
  using Running = RunningMachine;
  [[nodiscard]] std::shared_ptr<const Running> running() const;

  // -- spawned and deleted robots
  // Prepares a robot on any thread while the twin runs: description, model, shapes, the world compiled with
  // it, and its controllers rehearsed. `text`: a URDF, or a model of SDF that its plugins drive. Throws
  // InputError.
  [[nodiscard]] static std::shared_ptr<JoiningRobot> prepare_robot(
      const std::shared_ptr<const Running>& running, const WorldRobot& robot, const SpawnedText& text,
      Diagnostics& diagnostics);
  // The loop's thread, between steps. The state of the other robots stays bit-identical. Compiles only if
  // instances were added or removed since running(). Throws InputError if its name is already used or its
  // controllers cannot be started; nothing has changed then.
  void add_robot(const std::shared_ptr<JoiningRobot>& joining);
  // Removes a robot with its controllers, topics and services. Refuses if no robot has this namespace, if the
  // robot has none, or if it is the only one.
  Status remove_robot(const std::string& name_space);

  // Called on the loop's thread after a robot was added or removed.
  void on_robots_changed(std::function<void()> callback);

  // The scenario with each choice that was made for it (Scenario::complete): a twin of it guesses nothing and
  // has the same state hash. Before the first step.
  [[nodiscard]] Scenario complete_scenario() const;

  // -- reload of the sources
  // A machine made from the scenario's current files, built beside the running machine; opaque.
  using Replacement = TwinReplacement;
  // On any thread. Throws InputError if the files cannot be used; the running machine is not affected.
  [[nodiscard]] static std::shared_ptr<Replacement> prepare(const std::shared_ptr<const Running>& running,
                                                            Diagnostics& diagnostics);
  // The loop's thread, between steps: the replacement continues from the present time and joint state. The
  // controllers of robots with the same links, joints, interfaces and controllers' YAML continue; those of
  // other robots are recreated, and formerly active ones activated again. Throws InputError if that fails, or
  // if a robot was added or removed since prepare(); the old machine then keeps running.
  enum class Reload { controllers_kept, controllers_recreated };
  Reload replace(const std::shared_ptr<Replacement>& replacement);
  // The instances and the robots of a replacement, before replace().
  [[nodiscard]] static std::vector<ModelInstance> instances(const Replacement& replacement);
  [[nodiscard]] static const std::vector<std::shared_ptr<const CompiledRobot>>& robots(
      const Replacement& replacement);
  [[nodiscard]] static std::vector<std::filesystem::path> files(const Replacement& replacement);
  // The present descriptions of the robots' files, without those that cannot be expanded: of an edit that
  // prepare() refuses. On any thread.
  [[nodiscard]] static std::vector<ExpandedDescription> expand(const Running& running);
  // All files from which the twin was made, which a reload watches. The loop's thread.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;

  [[nodiscard]] Time now() const;
  [[nodiscard]] std::uint64_t steps() const;
  [[nodiscard]] std::uint64_t steps_taken() const;  // which a restored state does not set back
  // A hash over the state of all instances, including objects, of every step so far.
  [[nodiscard]] std::uint64_t state_hash() const;
  [[nodiscard]] bool diverged() const;
  // The sensors of light of all robots. The loop's thread.
  [[nodiscard]] std::vector<RigStatus> sensors() const;

  // "omarm_one", or "left, right"; without robots the world's.
  [[nodiscard]] std::string name() const;
  // None: a world of objects. A reference is valid until the robots change.
  [[nodiscard]] const std::vector<std::unique_ptr<TwinRobot>>& robots() const;
  // The first robot, which is the only one of most twins. Precondition: there is one.
  [[nodiscard]] TwinRobot& robot() const { return *robots().front(); }
  // A scalar joint of the first robot. Throws InputError with the nearest name.
  [[nodiscard]] JointHandle joint(std::string_view name);
  // nullptr: no robot has this namespace.
  [[nodiscard]] TwinRobot* find_robot(std::string_view name_space) const;
  [[nodiscard]] Engine& engine();
  [[nodiscard]] const Engine& engine() const;
  [[nodiscard]] Bus& bus();
  [[nodiscard]] TimeControl& time_control();
  [[nodiscard]] Duration step_size() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
