#include "doppel/control/controllers/detail/gripper_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

using control_msgs::action::GripperCommand;
using control_msgs::action::ParallelGripperCommand;

ParameterOptions at_least(double least, const char* description, bool read_only = false) {
  return {description, read_only, {}, ParameterRange{least, std::numeric_limits<double>::infinity()}};
}

template <class T>
T get(Node& node, const std::string& name) {
  return std::get<T>(node.parameters().find(name)->value);
}

}  // namespace

void GripperController::on_init(ControllerContext& context) {
  context_ = &context;
  Parameters& parameters = context.node->parameters();
  ParameterOverrides* written = context.overrides;
  const bool parallel = kind_ == Kind::parallel;
  settings_.joint = declare<std::string>(parameters, written, "joint", "", {"the gripper's", true});
  if (settings_.joint.empty() || check_joints(context, "joint", {settings_.joint}).empty()) {
    throw InputError("control.empty_parameter", place_of(context, "joint"),
                     fmt::format("controller '{}' has no joint to drive", context.name),
                     "write joint: NAME below its ros__parameters");
  }
  declare<double>(parameters, written, "action_monitor_rate", 20.0, at_least(0.1, "Hz", parallel));
  declare<double>(parameters, written, "goal_tolerance", 0.01, at_least(0, "position tolerance of the goal"));
  declare<double>(parameters, written, "max_effort", parallel ? 10.0 : 0.0,
                  at_least(0, "Max allowable effort"));
  declare<bool>(parameters, written, "allow_stalling", false, {"a stall counts as success"});
  declare<double>(parameters, written, "stall_velocity_threshold", 0.001,
                  {"velocity below which the gripper stalls"});
  declare<double>(parameters, written, "stall_timeout", 1.0,
                  at_least(0, "s below that velocity until it has stalled"));
  if (parallel) {
    declare<std::vector<std::string>>(parameters, written, "state_interfaces", {kPosition, kVelocity},
                                      {"position and velocity", true});
    declare<std::string>(parameters, written, "max_effort_interface", "", {"claimed if named", true});
    declare<std::string>(parameters, written, "max_velocity_interface", "", {"claimed if named", true});
    declare<double>(parameters, written, "max_velocity", 0.1, at_least(0, "of a goal without max_effort"));
  }
  if (kind_ == Kind::effort) {
    for (const char* gain : {"p", "i", "d", "i_clamp"}) {
      declare<double>(parameters, written, fmt::format("gains.{}.{}", settings_.joint, gain), 0.0,
                      {"of the PID from position to effort"});
    }
  }
  read_settings();
  open_action(*context.node);
  context.node->subscribe<control_msgs::msg::GripperCommand>(
      "~/command",
      [this](const auto& message) {
        Command command{message.position, message.max_effort, std::nullopt};
        if (message.max_effort < 0) command.effort.reset();
        static_cast<void>(take(command));  // a refusal is logged there
      },
      {.depth = 1});
}

// As in ros2_controllers, changed parameters take effect at the next configuration.
void GripperController::read_settings() {
  Node& node = *context_->node;
  settings_.action_monitor_rate = get<double>(node, "action_monitor_rate");
  settings_.goal_tolerance = get<double>(node, "goal_tolerance");
  settings_.max_effort = get<double>(node, "max_effort");
  settings_.allow_stalling = get<bool>(node, "allow_stalling");
  settings_.stall_velocity_threshold = get<double>(node, "stall_velocity_threshold");
  settings_.stall_timeout = get<double>(node, "stall_timeout");
  if (kind_ == Kind::parallel) {
    settings_.max_velocity = get<double>(node, "max_velocity");
    settings_.max_effort_interface = get<std::string>(node, "max_effort_interface");
    settings_.max_velocity_interface = get<std::string>(node, "max_velocity_interface");
  }
  if (kind_ == Kind::effort) {
    const auto gain = [&](const char* name) {
      return get<double>(node, fmt::format("gains.{}.{}", settings_.joint, name));
    };
    PidGains gains;
    gains.p = gain("p");
    gains.i = gain("i");
    gains.d = gain("d");
    gains.i_clamp_max = std::abs(gain("i_clamp"));
    gains.i_clamp_min = -gains.i_clamp_max;
    pid_.set_gains(gains);
  }
}

InterfaceConfiguration GripperController::command_interfaces() const {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  wanted.names.push_back(settings_.joint + "/" + (kind_ == Kind::effort ? kEffort : kPosition));
  for (const std::string* more : {&settings_.max_effort_interface, &settings_.max_velocity_interface}) {
    if (!more->empty()) wanted.names.push_back(*more);
  }
  return wanted;
}

InterfaceConfiguration GripperController::state_interfaces() const {
  return {InterfaceConfiguration::Kind::individual,
          {settings_.joint + "/" + kPosition, settings_.joint + "/" + kVelocity}};
}

Status GripperController::on_configure() {
  read_settings();
  return {};
}

Status GripperController::on_activate() {
  position_ = state_handles[0].get();
  velocity_ = state_handles[1].get();
  if (!std::isfinite(position_))
    return Status::refused(fmt::format("joint '{}' has no measured position yet", settings_.joint));
  hold_here();
  pid_.reset();
  goal_.reset();
  ended_.reset();
  computed_ = 0;
  active_ = true;
  return {};
}

Status GripperController::on_deactivate() {
  active_ = false;
  if (goal_) {
    finish(*goal_, GoalStatus::aborted, ended_.value_or(Outcome{position_, computed_, false, false}));
    goal_.reset();
    context_->log->warning(context_->name, "the goal is aborted because the controller is deactivated");
  }
  // An effort that is no longer controlled must not remain.
  if (kind_ == Kind::effort) command_handles[0].set(0.0);
  return {};
}

void GripperController::hold_here() {
  target_ = position_;
  max_effort_ = settings_.max_effort;
  max_velocity_ = settings_.max_velocity;
}

// From now on the target, in place of a goal in progress.
Status GripperController::take(const Command& command) {
  const auto refuse = [this](const std::string& why) {
    context_->log->error(context_->name, why + "; the command is rejected");
    return Status::refused(why);
  };
  if (!active_) return refuse(fmt::format("'{}' is not active; activate it first", context_->name));
  if (!std::isfinite(command.position)) return refuse("the commanded position is not a finite number");
  if (std::isnan(command.effort.value_or(0)) || std::isnan(command.velocity.value_or(0)))
    return refuse("the commanded effort or velocity is not a number, so it cannot be limited");
  if (goal_) finish(*goal_, GoalStatus::canceled, {});  // preempted; an empty result, as in ros2_controllers
  ended_.reset();
  goal_.reset();
  target_ = command.position;
  max_effort_ = command.effort.value_or(settings_.max_effort);
  max_velocity_ = command.velocity.value_or(settings_.max_velocity);
  last_movement_ = context_->node->bus().now();
  if (kind_ == Kind::effort && max_effort_ == 0 && !error_logged_) {
    error_logged_ = true;
    context_->log->warning(context_->name,
                           "the command has max_effort 0, so the gripper does not move; set max_effort");
  }
  return {};
}

Status GripperController::accept(const GoalId& id, const Command& command) {
  if (Status taken = take(command); !taken) return taken;
  goal_ = id;
  begin(id);
  return {};
}

Status GripperController::cancel(const GoalId& id) {
  if (goal_ != id) return {};
  hold_here();
  finish(id, GoalStatus::canceled, {});
  goal_.reset();
  ended_.reset();
  return {};
}

void GripperController::check_goal(Time now) {
  if (!goal_ || ended_) return;
  if (std::abs(target_ - position_) < settings_.goal_tolerance) {
    ended_ = Outcome{position_, computed_, false, true};
  } else if (std::abs(velocity_) > settings_.stall_velocity_threshold || now < last_movement_) {
    last_movement_ = now;
  } else if (to_seconds(now - last_movement_) > settings_.stall_timeout) {
    ended_ = Outcome{position_, computed_, true, false};
  }
}

void GripperController::drive(Duration period) {
  if (kind_ == Kind::effort) {
    const double most = std::abs(max_effort_);
    computed_ = std::clamp(pid_.compute(target_ - position_, -velocity_, to_seconds(period)), -most, most);
    command_handles[0].set(computed_);
    return;
  }
  command_handles[0].set(target_);
  if (kind_ == Kind::position) computed_ = max_effort_;
  std::size_t next = 1;
  if (!settings_.max_effort_interface.empty()) command_handles[next++].set(max_effort_);
  if (!settings_.max_velocity_interface.empty()) command_handles[next].set(max_velocity_);
}

void GripperController::update(Time now, Duration period) {
  position_ = state_handles[0].get();
  velocity_ = state_handles[1].get();
  check_goal(now);
  drive(period);
}

void GripperController::housekeeping(Time /*now*/) {
  if (!goal_) return;
  if (!ended_) return feed_back(*goal_, {position_, computed_, false, false});
  const bool fine = ended_->reached || settings_.allow_stalling;
  const GoalId id = *goal_;
  const Outcome outcome = *ended_;
  goal_.reset();
  ended_.reset();
  if (!fine) {
    context_->log->warning(
        context_->name, fmt::format("the gripper stalled at {:.4g} on its way to {:.4g}; the goal is aborted",
                                    outcome.position, target_));
  }
  finish(id, fine ? GoalStatus::succeeded : GoalStatus::aborted, outcome);
}

namespace {

std::optional<double> first_of(const std::vector<double>& values) {
  return values.empty() ? std::nullopt : std::optional(values.front());
}

template <class Message, class Outcome>
void fill(Message& message, const std::string& joint, const Outcome& outcome) {
  if constexpr (requires { message.state; }) {
    message.state.name = {joint};
    message.state.position = {outcome.position};
    message.state.effort = {outcome.effort};
  } else {
    message.position = outcome.position;
    message.effort = outcome.effort;
  }
  if constexpr (requires { message.stalled; }) {
    message.stalled = outcome.stalled;
    message.reached_goal = outcome.reached;
  }
}

}  // namespace

template <Action A>
void GripperActionController<A>::open_action(Node& node) {
  const auto on_goal = [this](const GoalId& id, const typename A::Goal& goal) {
    if constexpr (std::same_as<A, ParallelGripperCommand>) {
      const auto& command = goal.command;
      if (command.position.size() != 1)
        return Status::refused(
            fmt::format("a goal has one position, this one has {}", command.position.size()));
      return accept(id, {command.position[0], first_of(command.effort), first_of(command.velocity)});
    } else {
      return accept(id, {goal.command.position, goal.command.max_effort, std::nullopt});
    }
  };
  action_ = std::make_unique<ActionServer<A>>(
      node, "~/gripper_cmd",
      typename ActionServer<A>::Callbacks{on_goal, [this](const GoalId& id) { return cancel(id); }});
}

template <Action A>
void GripperActionController<A>::feed_back(const GoalId& id, const Outcome& outcome) {
  typename A::Feedback feedback;
  fill(feedback, joint(), outcome);
  action_->publish_feedback(id, feedback);
}

template <Action A>
void GripperActionController<A>::finish(const GoalId& id, GoalStatus status, const Outcome& outcome) {
  typename A::Result result;
  if (status != GoalStatus::canceled) fill(result, joint(), outcome);  // a cancelled goal has no outcome
  action_->finish(id, status, result);
}

template class GripperActionController<GripperCommand>;
template class GripperActionController<ParallelGripperCommand>;

}  // namespace doppel
