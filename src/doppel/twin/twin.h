#pragma once
// The twin: robots in one world under their controllers, in one engine on one clock. Construction does
// everything that may fail or allocate; step() is the loop's body: read - update - write - step - publish, at
// fixed simulated time. The same inputs give the same bytes.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/control/control_loop.h"
#include "doppel/core/diagnostic.h"
#include "doppel/core/log.h"
#include "doppel/export.h"
#include "doppel/physics/engine.h"
#include "doppel/twin/loop_meter.h"
#include "doppel/twin/scenario.h"
#include "doppel/twin/twin_robot.h"

namespace doppel {

struct TimeControl;  // simulator_services.h

class DOPPEL_API Twin {
 public:
  // Throws InputError. Warnings and notes go to `diagnostics`; what is said later goes to `log`, which
  // outlives the twin.
  Twin(const Scenario& scenario, const Log& log, Diagnostics& diagnostics);
  ~Twin();
  Twin(const Twin&) = delete;
  Twin& operator=(const Twin&) = delete;

  // -- the loop's thread
  // One physics step, with the controllers' ticks and the publications that are due. No allocation, no throw,
  // no lock but hold().
  void step();
  // Between steps: what edges sent, reports, results. Allocates only where there is something to do.
  void between_steps();
  void reset();  // to the start: time 0, start poses, at rest; active controllers hold there
  // /clock, /tf, joint states, loads, contacts and objects, as they are now: after the state was written or
  // time was stepped, so that pictures follow while time stands.
  void publish_state();
  // Wall time spent in step() so far by controllers and by publishing; the rest is not told apart here.
  [[nodiscard]] const LoopPhases& step_phases() const;

  // Real hardware has loops of their own, which use the bus, the controllers and the hardware, too: who has
  // this holds them off, and those that start meanwhile. What stands above takes it by itself; in a
  // simulation nobody else does. May be taken again by who has it. The loop's thread.
  [[nodiscard]] std::unique_lock<LoopGate> hold();

  // What runs, for what is made ready beside it; opaque. The loop's thread.
  struct Running;
  [[nodiscard]] std::shared_ptr<const Running> running() const;

  // -- robots that come and go
  // Made ready on any thread, beside what runs: description, model, shapes, the world compiled with it, and
  // its controllers rehearsed. Throws InputError.
  struct JoiningRobot;
  [[nodiscard]] std::shared_ptr<JoiningRobot> prepare_robot(const std::shared_ptr<const Running>& running,
                                                            const WorldRobot& robot, const std::string& urdf,
                                                            Diagnostics& diagnostics) const;
  // The loop's thread, between steps. No bit of the others' state changes by it. Compiles only where
  // instances came or went since running(). Throws InputError: its name is taken, or its controllers do not
  // come up; nothing has changed then.
  void add_robot(const std::shared_ptr<JoiningRobot>& joining);
  // With its controllers, topics and services. Refused: no robot has this namespace, it has none, or it is
  // the only one.
  Status remove_robot(const std::string& name_space);

  // Called on the loop's thread after a robot has come or gone.
  void on_robots_changed(std::function<void()> callback);

  // -- reload of the sources
  // A machine made from the scenario's current files, built beside the running machine; opaque.
  struct Replacement;
  // On any thread. Throws InputError where the files cannot be used: what runs is untouched.
  [[nodiscard]] std::shared_ptr<Replacement> prepare(const std::shared_ptr<const Running>& running,
                                                     Diagnostics& diagnostics) const;
  // The loop's thread, between steps: the replacement continues from the present time and joint state. Robots
  // with the same links, joints, interfaces and controllers' YAML have their controllers continue with what
  // they are doing; the others' are recreated, and those that were active are so again. Throws InputError
  // where they cannot, or where a robot came or went since prepare(); the old machine runs on then.
  enum class Reload { controllers_kept, controllers_recreated };
  Reload replace(const std::shared_ptr<Replacement>& replacement);
  // What it is made of, before it takes over.
  [[nodiscard]] static std::vector<ModelInstance> instances(const Replacement& replacement);
  // Every file that the twin was made of: what a reload watches. The loop's thread.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;

  [[nodiscard]] Time now() const;
  [[nodiscard]] std::uint64_t steps() const;
  // Over the state of all instances, objects too, at every step so far.
  [[nodiscard]] std::uint64_t state_hash() const;
  [[nodiscard]] bool diverged() const;

  // "omarm_one", or "left, right".
  [[nodiscard]] std::string name() const;
  // At least one. A reference is valid until the robots change.
  [[nodiscard]] const std::vector<std::unique_ptr<TwinRobot>>& robots() const;
  // The first one: the only one of most twins.
  [[nodiscard]] TwinRobot& robot() const { return *robots().front(); }
  // Null: none has this namespace.
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
