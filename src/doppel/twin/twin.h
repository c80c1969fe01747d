#pragma once
// The twin: one robot in one world under its controllers, on one clock. Construction does everything that may
// fail or allocate; step() is the loop's body: read - update - write - step - publish, at fixed simulated
// time. The same inputs give the same bytes.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/core/diagnostic.h"
#include "doppel/core/log.h"
#include "doppel/physics/engine.h"
#include "doppel/twin/control_stack.h"
#include "doppel/twin/loop_meter.h"
#include "doppel/twin/rest_check.h"
#include "doppel/twin/scenario.h"

namespace doppel {

struct TimeControl;  // simulator_services.h

struct JointSnapshot {
  std::string name;
  double q = 0, v = 0, tau = 0;             // rad or m, per s, N m or N
  double target = 0;                        // NaN: nothing commands it
  double lower = 0, upper = 0, effort = 0;  // limits; infinite: none
  bool mimics = false;
};

struct SagReport {
  std::string joint;
  double torque = 0, sag = 0, least = 0, most = 0, margin = 0;  // see Sag in physics/servo.h
};

struct OscillationReport {
  std::string joint, message;  // see oscillation_watch.h
};

class Twin {
 public:
  // Throws InputError. Warnings and notes go to `diagnostics`; what is said later goes to `log`, which
  // outlives the twin.
  Twin(const Scenario& scenario, const Log& log, Diagnostics& diagnostics);
  ~Twin();
  Twin(const Twin&) = delete;
  Twin& operator=(const Twin&) = delete;

  // -- the loop's thread
  // One physics step, with the controllers' tick and the publications that are due. No allocation, no lock,
  // no throw.
  void step();
  // Between steps: what edges sent, reports, results. Allocates only where there is something to do.
  void between_steps();
  void reset();  // to the start: time 0, start pose, at rest; active controllers hold there
  // /clock, /tf, /joint_states and what is told of loads, contacts and objects, as it is now: after the state
  // was written or time was stepped, so that pictures follow while time stands.
  void publish_state();
  // Wall time spent in step() so far by controllers and by publishing; the rest is not told apart here.
  [[nodiscard]] const LoopPhases& step_phases() const;

  // -- reload of the sources
  // What the scenario's files say now, built beside the running machine; opaque.
  struct Replacement;
  // What is to run after a reload; the loop's thread.
  [[nodiscard]] ControllerWish present_controllers() const;
  // On any thread. Throws InputError where the files cannot be used: what runs is untouched.
  [[nodiscard]] std::shared_ptr<Replacement> prepare(const ControllerWish& wish,
                                                     Diagnostics& diagnostics) const;
  // The loop's thread, between steps: the replacement goes on from the present time and joint state. With the
  // same links, joints, interfaces and controllers' YAML, controllers go on with what they are doing; else
  // they are made anew, and those that were active are so again. Throws InputError where they cannot; the old
  // machine runs on then.
  enum class Reload { controllers_went_on, controllers_made_anew };
  Reload replace(const std::shared_ptr<Replacement>& replacement);
  // What it is made of, before it takes over.
  [[nodiscard]] static const RobotDescription& description(const Replacement& replacement);
  [[nodiscard]] static const std::vector<WorldObject>& objects(const Replacement& replacement);
  // Every file that the twin was made of: what a reload watches. The loop's thread.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;

  [[nodiscard]] Time now() const;
  [[nodiscard]] std::uint64_t steps() const;
  // FNV-like hash over the bits of every joint's q, v and drive effort at every step so far.
  [[nodiscard]] std::uint64_t state_hash() const;
  [[nodiscard]] bool diverged() const;

  [[nodiscard]] const std::string& robot_name() const;
  [[nodiscard]] std::string controllers_origin() const;
  [[nodiscard]] const Model& model() const;
  [[nodiscard]] const RobotDescription& description() const;
  [[nodiscard]] Engine& engine();
  [[nodiscard]] ControllerManager& controller_manager();
  [[nodiscard]] Bus& bus();
  [[nodiscard]] TimeControl& time_control();
  [[nodiscard]] std::vector<JointSnapshot> joints() const;  // scalar joints, in the model's order
  // What was not at rest kRestTime after the start; none: not yet, no controllers were to start, or somebody
  // commanded the robot.
  [[nodiscard]] const std::optional<RestReport>& rest() const;
  // What oscillated while its drive held it, so far.
  [[nodiscard]] const std::vector<OscillationReport>& oscillations() const;
  [[nodiscard]] std::vector<SagReport> gravity_sag() const;  // at the present pose
  [[nodiscard]] Duration step_size() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
