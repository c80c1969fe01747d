#pragma once
// One robot of a twin: its instance in the engine, its controller manager with the hardware, and its periodic
// tasks (transforms, loads, checks), in its namespace.

#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/log.h"
#include "doppel/control/manager/control_loop.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/scenario/schema/scenario.h"
#include "doppel/twin/loop/control_stack.h"
#include "doppel/twin/loop/rest_check.h"
#include "doppel/twin/loop/state_publisher.h"
#include "doppel/twin/loop/tickable.h"

namespace doppel {

class Shadow;  // detail/shadow.h

struct JointSnapshot {
  std::string name;
  double q = 0, v = 0, tau = 0;             // rad or m, per s, N m or N
  double target = 0;                        // rad or m; NaN: no command
  double lower = 0, upper = 0, effort = 0;  // limits; infinite: none
  bool mimics = false;
};

struct SagReport {
  std::string joint;
  double torque = 0, sag = 0, least = 0, most = 0, margin = 0;  // see Sag in physics/contract/servo.h
};

struct OscillationReport {
  std::string joint, message;  // see oscillation_watch.h
};

class DOPPEL_API TwinRobot {
 public:
  // The environment of the robot in its twin; outlives the robot.
  struct Surroundings {
    Bus& bus;
    const ControllerRegistry& controllers;
    const HardwareRegistry& hardware;
    const Scenario& scenario;
    const Log& log;
    LoopGate& gate;  // protects everything that loops of real hardware use
    std::shared_ptr<StaticTransforms> statics;
    std::shared_ptr<const EarthFrame> earth;  // of the present world
    std::shared_ptr<RangeValues> ranges;      // of the twin's range sensors
    std::vector<KeepOutBox> keep_out = {};    // of the world file
  };
  // State that is kept when the robot is rebuilt: the reports so far, and the hash.
  struct History {
    RestCheck rest;
    std::vector<OscillationReport> oscillations;
    std::uint64_t hash = 0;
    std::set<std::string> unbound = {};  // findings of ControlStack::unbound() that were logged
  };
  // The state that changes while the robot runs.
  struct Saved {
    SavedSlot manager;
    std::optional<RestCheck> rest;
    std::vector<OscillationReport> oscillations;
    std::uint64_t hash = 0, next_tick = 0;
    Time next_housekeeping{};
    SavedTicks ticks;
  };
  // former: in whose place it is made, with its history and the start of its sensors; nullptr: none.
  // Neither loads controllers nor publishes anything yet. Throws InputError.
  TwinRobot(const Surroundings& around, std::shared_ptr<const CompiledRobot> machine, Instance instance,
            const TwinRobot* former, Diagnostics& diagnostics);
  ~TwinRobot();
  TwinRobot(const TwinRobot&) = delete;
  TwinRobot& operator=(const TwinRobot&) = delete;

  // -- between steps
  // Makes new publishers for a machine and returns the former ones, which are kept until a restore is no
  // longer possible. Throws InputError; nothing has changed then.
  TickList make_publishers();
  void restore_publishers(TickList before) { ticks_ = std::move(before); }
  // Throws InputError; nothing is active then.
  void start(const ControllerSelection& selection) { control_->start(selection, log()); }
  // The same for a robot that has not run before: what it chooses, unless the scenario starts no controllers.
  void start_first();
  // Starts the ControlLoop of real hardware, in wall-clock time besides the simulation. With the gate.
  void start_loop();
  // Replaces the machine by one with the same structure; controllers continue. Publishers must be recreated
  // afterwards. The former machine can be restored by the same function, unchanged.
  void take_over(std::shared_ptr<const CompiledRobot> machine, Instance now);
  void carry_references(const Instance& before) { control_->carry_references(before, instance_); }
  void rebind(Instance instance);
  // Handles failures since the last tick, before received requests are handled.
  void settle(Time now) {
    if (loop_) {
      loop_->attend();
    } else {
      control_->manager().settle(now);
    }
  }
  void between_steps(Time now);
  void reset(Time now);  // controllers hold the robot's present pose, and sensors start again
  // The robot's state was written: controllers hold its pose; sensors keep their start and their noise.
  void state_written(Time now) {
    control_->state_written();
    control_->manager().restart(control_time(now));
  }
  // See ControlStack.
  [[nodiscard]] bool has_emulated_devices() const { return control_->has_emulated_devices(); }
  [[nodiscard]] std::vector<std::string> awaited_hardware() const { return control_->awaited(); }
  bool guide(std::string_view joint, double position) { return control_->guide(joint, position); }
  void show(Time now);  // publishes its present state
  void robots_changed(Time now) { ticks_.robots_changed(now); }
  // Saved states: see ControllerManager. Refused with the names of hardware that cannot be saved.
  Status save(Saved& out);
  void restore_values(const Saved& saved, Time now);

  // -- in the loop: no allocation, no lock, no throw
  [[nodiscard]] bool control_due(std::uint64_t step) const { return step >= next_tick_; }
  void tick_control(std::uint64_t step, Time now) {
    if (!loop_) {
      control_->manager().tick(now);
      history_.hash = control_->with_sensors(history_.hash);
    }
    next_tick_ = step + steps_per_tick_;
  }
  // A separate thread ticks the controllers, because a component is real hardware.
  [[nodiscard]] bool has_loop() const { return loop_ != nullptr; }
  // The controllers' time: with a ControlLoop it continues while the simulation is paused.
  [[nodiscard]] Time control_time(Time now) const { return loop_ ? loop_->now() : now; }
  void control_at_once(std::uint64_t step) { next_tick_ = step; }
  void before_step(std::uint64_t step);
  void after_step(Time now);
  // q as clients see it: of joints with real hardware the measured positions, of others the instance's.
  [[nodiscard]] std::span<const double> present_q() const;
  // True: the joint's position is read from real hardware. False for a mimic joint of such a one.
  [[nodiscard]] bool is_measured(int joint) const;
  // True: the instance stands beside real hardware and got its commands in the last step (MirrorMode).
  [[nodiscard]] bool is_shadow() const;
  [[nodiscard]] bool publication_due(Time now) const { return ticks_.is_due(now); }
  void publish_due(Time now) { ticks_.publish_due(now); }

  [[nodiscard]] const std::string& name() const { return machine_->name(); }
  [[nodiscard]] const std::string& name_space() const { return machine_->name_space(); }  // "left"
  [[nodiscard]] const CompiledRobot& machine() const { return *machine_; }
  [[nodiscard]] const std::shared_ptr<const CompiledRobot>& shared_machine() const { return machine_; }
  [[nodiscard]] const Model& model() const { return machine_->model(); }
  [[nodiscard]] Duration step() const { return instance_.engine().world().settings().step; }
  [[nodiscard]] const RobotDescription& description() const { return machine_->description(); }
  [[nodiscard]] Instance& instance() { return instance_; }
  [[nodiscard]] const Instance& instance() const { return instance_; }
  [[nodiscard]] ControllerManager& controller_manager() { return control_->manager(); }
  [[nodiscard]] const ControllerManager& controller_manager() const { return control_->manager(); }
  [[nodiscard]] ControllerSelection present_selection() const { return control_->present_selection(); }
  [[nodiscard]] std::string controllers_origin() const;
  [[nodiscard]] RobotChoices choices() const;               // as it runs now
  [[nodiscard]] std::vector<JointSnapshot> joints() const;  // scalar joints, in the model's order
  // The joints that were not at rest kRestTime after the start; nullopt: not yet, no controllers were to
  // start, or the robot was commanded.
  [[nodiscard]] const std::optional<RestReport>& rest() const { return history_.rest.report(); }
  // The joints so far that oscillated while held by their drives.
  [[nodiscard]] const std::vector<OscillationReport>& oscillations() const { return history_.oscillations; }
  // At the present pose, of the drives that hold a position.
  [[nodiscard]] std::vector<SagReport> gravity_sag() const;
  // Those whose load exceeds their effort limit; between steps, a warning for each that is not `known`.
  [[nodiscard]] std::set<std::string> overloaded_joints() const;
  void report_overloads(const std::set<std::string>& known);
  // Concludes the rest check at the end of a run, if kRestTime has not passed; does nothing after it.
  void conclude_rest();
  // Why there is no complete report; empty: there is one.
  [[nodiscard]] std::string rest_reason() const;
  // A hash over the bits of every q, v and drive effort of every step so far, and of the sensors that
  // controllers read.
  [[nodiscard]] std::uint64_t state_hash() const { return history_.hash; }

 private:
  [[nodiscard]] const Log& log() const { return name_space().empty() ? around_.log : own_log_; }
  void report_rest();
  void report_unbound();
  void report_oscillation(const std::string& joint, std::string message);

  Surroundings around_;
  Log own_log_;  // of a robot with a namespace: the twin's log, with the namespace as prefix of each origin
  std::shared_ptr<const CompiledRobot> machine_;
  Instance instance_;
  std::unique_ptr<ControlStack> control_;
  std::unique_ptr<ControlLoop> loop_;  // nullptr: no real hardware, the twin ticks the manager
  std::unique_ptr<Shadow> shadow_;     // nullptr: no real hardware, the instance is the robot
  History history_;
  TickList ticks_;
  std::uint64_t steps_per_tick_ = 1, next_tick_ = 0;
  Time next_housekeeping_ = Time::min();
};

}  // namespace doppel
