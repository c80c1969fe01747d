#pragma once
// One robot of a twin: its instance in the engine, its controller manager with the hardware, and what ticks
// for it (transforms, loads, checks), below its namespace.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/core/diagnostic.h"
#include "doppel/core/log.h"
#include "doppel/physics/engine.h"
#include "doppel/twin/control_stack.h"
#include "doppel/twin/rest_check.h"
#include "doppel/twin/scenario.h"
#include "doppel/twin/state_publisher.h"
#include "doppel/twin/ticking.h"

namespace doppel {

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

class TwinRobot {
 public:
  // Of its twin; all of it outlives the robot.
  struct Surroundings {
    Bus& bus;
    const ControllerRegistry& controllers;
    const HardwareRegistry& hardware;
    const Scenario& scenario;
    const Log& log;
    std::shared_ptr<StaticTransforms> statics;
  };
  // What outlasts a machine: what was found so far, and the hash.
  struct Past {
    RestCheck rest;
    std::vector<OscillationReport> oscillations;
    std::uint64_t hash = 0;
  };
  // Controllers are not loaded, and nothing is published yet. Throws InputError.
  TwinRobot(const Surroundings& around, std::shared_ptr<const RobotMachine> machine, Instance instance,
            std::optional<Past> past, Diagnostics& diagnostics);
  TwinRobot(const TwinRobot&) = delete;
  TwinRobot& operator=(const TwinRobot&) = delete;

  // -- between steps
  // Anew for every machine. Throws InputError; nothing is published then.
  void make_publishers();
  // Throws InputError; nothing is active then.
  void start(const ControllerWish& wish) { control_->start(wish, log()); }
  // What is to run where nothing has run before.
  [[nodiscard]] ControllerWish first_wish() const { return control_->wish_of(machine_->asked().activate); }
  // A machine of the same structure takes over; controllers go on. Publishers are to be made anew then.
  void take_over(std::shared_ptr<const RobotMachine> machine, Instance now);
  void rebind(Instance instance);
  void settle(Time now) { control_->manager().settle(now); }  // before what came in runs
  void between_steps(Time now);
  void reset(Time now);                                         // controllers hold where the robot stands
  void restart(Time now) { control_->manager().restart(now); }  // the same, while time goes on
  void show(Time now);                                          // publishes its state as it is now
  void robots_changed(Time now) { ticks_.robots_changed(now); }

  // -- in the loop: no allocation, no lock, no throw
  [[nodiscard]] bool control_due(std::uint64_t step) const { return step >= next_tick_; }
  void tick_control(std::uint64_t step, Time now) {
    control_->manager().tick(now);
    next_tick_ = step + steps_per_tick_;
  }
  void control_at_once(std::uint64_t step) { next_tick_ = step; }
  void before_step(Time now) { ticks_.before_step(now); }
  void after_step(Time now);
  [[nodiscard]] bool publication_due(Time now) const { return ticks_.is_due(now); }
  void publish_due(Time now) { ticks_.publish_due(now); }

  [[nodiscard]] const std::string& name() const { return machine_->name(); }
  [[nodiscard]] const std::string& name_space() const { return machine_->name_space(); }  // "left"
  [[nodiscard]] const RobotMachine& machine() const { return *machine_; }
  [[nodiscard]] const std::shared_ptr<const RobotMachine>& shared_machine() const { return machine_; }
  [[nodiscard]] const Model& model() const { return machine_->model(); }
  [[nodiscard]] Duration step() const { return instance_.engine().world().settings().step; }
  [[nodiscard]] const RobotDescription& description() const { return machine_->description(); }
  [[nodiscard]] Instance& instance() { return instance_; }
  [[nodiscard]] const Instance& instance() const { return instance_; }
  [[nodiscard]] ControllerManager& controller_manager() { return control_->manager(); }
  [[nodiscard]] ControllerWish present_wish() const { return control_->present_wish(); }
  [[nodiscard]] std::string controllers_origin() const;
  [[nodiscard]] std::vector<JointSnapshot> joints() const;  // scalar joints, in the model's order
  // What was not at rest kRestTime after the start; none: not yet, no controllers were to start, or somebody
  // commanded the robot.
  [[nodiscard]] const std::optional<RestReport>& rest() const { return past_.rest.report(); }
  // What oscillated while its drive held it, so far.
  [[nodiscard]] const std::vector<OscillationReport>& oscillations() const { return past_.oscillations; }
  [[nodiscard]] std::vector<SagReport> gravity_sag() const;  // at the present pose
  // Over the bits of every q, v and drive effort at every step so far.
  [[nodiscard]] std::uint64_t state_hash() const { return past_.hash; }
  [[nodiscard]] const Past& past() const { return past_; }

 private:
  [[nodiscard]] const Log& log() const { return name_space().empty() ? around_.log : own_log_; }
  void report_rest();
  void report_oscillation(const std::string& joint, std::string message);

  Surroundings around_;
  Log own_log_;  // where there is a namespace: the twin's, with the namespace before each origin
  std::shared_ptr<const RobotMachine> machine_;
  Instance instance_;
  std::unique_ptr<ControlStack> control_;
  Past past_;
  TickList ticks_;
  std::uint64_t steps_per_tick_ = 1, next_tick_ = 0;
  Time next_housekeeping_ = Time::min();
};

}  // namespace doppel
