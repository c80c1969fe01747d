#include "app/verbs/joint_movers.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/verbs/goals.h"
#include "app/verbs/movable_joints.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/scenario/schema/command_kind.h"

namespace doppel::app {
namespace {

using control_msgs::action::GripperCommand;
using control_msgs::action::ParallelGripperCommand;
using controller_manager_msgs::msg::ControllerState;
using Follow = control_msgs::action::FollowJointTrajectory;

// A controller with an action.
class ActionMover : public JointMover {
 public:
  ActionMover(std::string controller, Positions targets, std::string action, const ActionSupport& type)
      : JointMover(std::move(controller), std::move(targets)), action_(std::move(action)), type_(type) {}

  void start(Client& twin, const RobotWatch& robot, double seconds) final {
    goal_.emplace(twin, action_, type_, goal(robot, seconds));
  }
  bool is_finished(const RobotWatch&) final {
    done_ = done_ || goal_->take_outcome(outcome_);
    return done_;
  }
  void cancel(const RobotWatch&) final {
    if (!done_) goal_->cancel();
  }
  [[nodiscard]] std::string problem() const final {
    if (outcome_.status == kSucceeded) return "";
    return fmt::format("{} ended with {}{}{}", controller(), status_name(outcome_.status),
                       outcome_.reason.empty() ? "" : ": ", outcome_.reason);
  }

 private:
  [[nodiscard]] virtual Bytes goal(const RobotWatch& robot, double seconds) const = 0;

  std::string action_;
  const ActionSupport& type_;
  std::optional<ActionGoal> goal_;
  GoalOutcome outcome_;
  bool done_ = false;
};

class TrajectoryMover final : public ActionMover {
 public:
  TrajectoryMover(std::string controller, Positions targets, std::string action,
                  std::vector<std::string> joints)
      : ActionMover(std::move(controller), std::move(targets), std::move(action), action_support<Follow>()),
        joints_(std::move(joints)) {}

 private:
  [[nodiscard]] Bytes goal(const RobotWatch& robot, double seconds) const override {
    Follow::Goal goal;
    goal.trajectory.joint_names = joints_;
    trajectory_msgs::msg::JointTrajectoryPoint point;
    for (const std::string& joint : joints_) {
      const auto target = targets().find(joint);
      const std::optional<double> present = robot.position(joint);
      if (target == targets().end() && !present) {
        throw ClientError(
            fmt::format("joint_states does not contain '{}', which {} moves too", joint, controller()));
      }
      point.positions.push_back(target != targets().end() ? target->second : *present);
    }
    point.time_from_start = to_duration_msg(from_seconds(seconds));
    goal.trajectory.points.push_back(std::move(point));
    return to_cdr(goal);
  }

  std::vector<std::string> joints_;  // all that the controller commands
};

class GripperMover final : public ActionMover {
 public:
  GripperMover(std::string controller, Positions targets, std::string action, const ActionSupport& type,
               double max_effort)
      : ActionMover(std::move(controller), std::move(targets), std::move(action), type),
        is_parallel_(type.name == action_support<ParallelGripperCommand>().name),
        max_effort_(max_effort) {}
  [[nodiscard]] bool is_timed() const override { return false; }

 private:
  [[nodiscard]] Bytes goal(const RobotWatch&, double) const override {
    const auto& [joint, position] = *targets().begin();
    if (is_parallel_) {
      ParallelGripperCommand::Goal goal;
      goal.command.name = {joint};
      goal.command.position = {position};
      return to_cdr(goal);
    }
    GripperCommand::Goal goal;
    goal.command.position = position;
    goal.command.max_effort = max_effort_;
    return to_cdr(goal);
  }

  bool is_parallel_;
  double max_effort_;
};

// A forward controller applies what it gets at once, so the positions on the way are sent one by one.
class ForwardMover final : public JointMover {
 public:
  ForwardMover(std::string controller, Positions targets, std::string topic, std::vector<std::string> joints)
      : JointMover(std::move(controller), std::move(targets)),
        topic_(std::move(topic)),
        joints_(std::move(joints)) {}

  [[nodiscard]] bool sends_all_the_way() const override { return true; }
  void start(Client& twin, const RobotWatch& robot, double seconds) override {
    twin_ = &twin;
    seconds_ = seconds;
    begin_ = robot.stamp();
    for (const std::string& joint : joints_) {
      const std::optional<double> present = robot.position(joint);
      if (!present) {
        throw ClientError(
            fmt::format("joint_states does not contain '{}', which {} moves too", joint, controller()));
      }
      from_.push_back(*present);
    }
    send(0);
    twin_->sync();
  }
  bool is_finished(const RobotWatch& robot) override {
    const double part = std::clamp(to_seconds(robot.stamp() - begin_) / seconds_, 0.0, 1.0);
    if (part_ < 1 && part > part_) send(part);
    return part_ >= 1;
  }
  void cancel(const RobotWatch& robot) override {
    for (std::size_t i = 0; i < joints_.size(); ++i) from_[i] = robot.position(joints_[i]).value_or(from_[i]);
    send(0);
    part_ = 1;
    canceled_ = true;
  }
  [[nodiscard]] std::string problem() const override {
    return canceled_ ? controller() + " ended with CANCELED" : "";
  }

 private:
  void send(double part) {
    std_msgs::msg::Float64MultiArray message;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const auto target = targets().find(joints_[i]);
      const double to = target == targets().end() ? from_[i] : target->second;
      message.data.push_back(from_[i] + part * (to - from_[i]));
    }
    twin_->publish(topic_, std::string(std_msgs::msg::Float64MultiArray::kType), to_cdr(message));
    if (part >= 1) twin_->sync();
    part_ = part;
  }

  std::string topic_;
  std::vector<std::string> joints_;  // in the order of the controller's values
  Client* twin_ = nullptr;
  double seconds_ = 0, part_ = 0;
  Time begin_{};
  std::vector<double> from_;
  bool canceled_ = false;
};

template <class Value>
Value parameter_or(Client& twin, const std::string& node, const std::string& name, Value otherwise) {
  for (const NamedParameter& parameter : twin.parameters(node)) {
    const auto* value = std::get_if<Value>(&parameter.value);
    if (parameter.name == name && value != nullptr) return *value;
  }
  return otherwise;
}

std::unique_ptr<JointMover> gripper(Client& twin, const RobotWatch& robot, const std::string& node,
                                    const ControllerState& controller, Positions targets) {
  const std::string action = node + "/gripper_cmd";
  const std::string type = find_action_type(twin, action);
  const ActionSupport* support = find_action(type);
  const bool is_usable =
      type == action_support<GripperCommand>().name || type == action_support<ParallelGripperCommand>().name;
  if (support == nullptr || !is_usable)
    throw ClientError(fmt::format("{} has the action type {}, which moves no gripper", action, type));
  double effort = parameter_or(twin, node, "max_effort", 0.0);
  const ModelJoint* joint = robot.find(targets.begin()->first);
  if (effort <= 0 && joint != nullptr && std::isfinite(joint->effort)) effort = joint->effort;
  return std::make_unique<GripperMover>(controller.name, std::move(targets), action, *support, effort);
}

std::unique_ptr<JointMover> make_mover(Client& twin, const RobotWatch& robot, const std::string& manager,
                                       const ControllerState& controller, Positions targets) {
  const std::string node = expand_name(controller.name, manager);
  switch (command_kind(controller.type)) {
    case CommandKind::trajectory:
      return std::make_unique<TrajectoryMover>(controller.name, std::move(targets),
                                               node + "/follow_joint_trajectory", joints_of(controller));
    case CommandKind::gripper:
      return gripper(twin, robot, node, controller, std::move(targets));
    case CommandKind::forward:
    case CommandKind::none:
      break;
  }
  return std::make_unique<ForwardMover>(controller.name, std::move(targets), node + "/commands",
                                        parameter_or(twin, node, "joints", joints_of(controller)));
}

}  // namespace

std::vector<std::unique_ptr<JointMover>> assign_movers(Client& twin, const RobotWatch& robot,
                                                       const std::string& manager, const Positions& targets,
                                                       const std::string& only) {
  const std::vector<ControllerState> controllers = list_controllers(twin, manager);
  check_controller(controllers, only);
  std::map<std::string, Positions> by_controller;
  for (const auto& [joint, position] : targets) {
    const auto mover = std::ranges::find_if(controllers, [&, &name = joint](const ControllerState& c) {
      return c.state == "active" && (only.empty() || c.name == only) && moves(c, name);
    });
    if (mover == controllers.end()) refuse_joint(twin, robot, manager, controllers, joint, position, only);
    by_controller[mover->name][joint] = position;
  }
  std::vector<std::unique_ptr<JointMover>> movers;
  for (const ControllerState& controller : controllers) {
    const auto found = by_controller.find(controller.name);
    if (found != by_controller.end())
      movers.push_back(make_mover(twin, robot, manager, controller, std::move(found->second)));
  }
  return movers;
}

}  // namespace doppel::app
