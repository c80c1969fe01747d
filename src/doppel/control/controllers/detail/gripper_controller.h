#pragma once
// Grippers of one joint, closed and opened by the action ~/gripper_cmd: position_controllers/ and
// effort_controllers/GripperActionController (control_msgs/action/GripperCommand) and
// parallel_gripper_action_controller/GripperActionController (ParallelGripperCommand), compatible with
// ros2_controllers' gripper_controllers and parallel_gripper_controller (Jazzy). A goal succeeds within
// goal_tolerance of its position. A joint that has not moved for stall_timeout has stalled: the goal then
// succeeds, because the gripper holds an object (allow_stalling), or fails.
//
// All of them also take ~/command (control_msgs/msg/GripperCommand), as PR2's gripper controller did: the newest command
// holds, without a result; a goal in progress is cancelled by it, as by another goal. A negative max_effort, PR2's
// "no limit", is the controller's own max_effort.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/pid.h"
#include "doppel/control/manager/controller.h"
#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {

// The common base; subclasses provide the type of the action.
class GripperController : public Controller {
 public:
  enum class Kind { position, effort, parallel };

  explicit GripperController(Kind kind) : kind_(kind) {}
  void on_init(ControllerContext& context) override;
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override;
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override;
  Status on_configure() override;
  Status on_activate() override;
  Status on_deactivate() override;
  void update(Time now, Duration period) override;
  void housekeeping(Time now) override;
  [[nodiscard]] double housekeeping_rate() const override { return settings_.action_monitor_rate; }

 protected:
  struct Command {
    double position = 0;                     // rad or m
    std::optional<double> effort, velocity;  // limits, if the goal has them: N m or N; rad/s or m/s
  };
  // The progress of a goal, or its result.
  struct Outcome {
    double position = 0, effort = 0;
    bool stalled = false, reached = false;
  };

  Status accept(const GoalId& id, const Command& command);
  Status take(const Command& command);
  Status cancel(const GoalId& id);
  [[nodiscard]] const std::string& joint() const { return settings_.joint; }

  virtual void open_action(Node& node) = 0;
  virtual void begin(const GoalId& id) = 0;
  virtual void feed_back(const GoalId& id, const Outcome& outcome) = 0;
  virtual void finish(const GoalId& id, GoalStatus status, const Outcome& outcome) = 0;

 private:
  struct Settings {
    std::string joint, max_effort_interface, max_velocity_interface;
    double action_monitor_rate = 20;  // Hz
    double goal_tolerance = 0.01;     // rad or m
    double max_effort = 0, max_velocity = 0.1;
    double stall_velocity_threshold = 0.001, stall_timeout = 1;  // rad/s or m/s; s
    bool allow_stalling = false;
  };
  void read_settings();
  void hold_here();
  void check_goal(Time now);
  void drive(Duration period);

  const Kind kind_;
  ControllerContext* context_ = nullptr;
  Settings settings_;
  Pid pid_;
  bool active_ = false, error_logged_ = false;
  double target_ = 0, max_effort_ = 0, max_velocity_ = 0;
  double position_ = 0, velocity_ = 0;  // measured
  double computed_ = 0;                 // the effort in a result
  std::optional<GoalId> goal_;
  Time last_movement_{};
  std::optional<Outcome> ended_;  // of goal_: set in the loop, reported between steps
};

template <Action A>
class GripperActionController : public GripperController {
 public:
  using GripperController::GripperController;

 private:
  void open_action(Node& node) override;
  void begin(const GoalId& id) override { action_->set_executing(id); }
  void feed_back(const GoalId& id, const Outcome& outcome) override;
  void finish(const GoalId& id, GoalStatus status, const Outcome& outcome) override;

  std::unique_ptr<ActionServer<A>> action_;
};

extern template class GripperActionController<control_msgs::action::GripperCommand>;
extern template class GripperActionController<control_msgs::action::ParallelGripperCommand>;

}  // namespace doppel
