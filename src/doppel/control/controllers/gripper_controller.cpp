// Grippers of one joint, closed and opened by the action ~/gripper_cmd: position_controllers/ and
// effort_controllers/GripperActionController (control_msgs/action/GripperCommand) and
// parallel_gripper_action_controller/GripperActionController (ParallelGripperCommand), compatible with
// ros2_controllers' gripper_controllers and parallel_gripper_controller (Jazzy). A goal succeeds within
// goal_tolerance of its position. A joint that has not moved for stall_timeout has stalled: the goal then
// succeeds, because the gripper holds an object (allow_stalling), or fails.
//
// All of them also take ~/command (control_msgs/msg/GripperCommand), as PR2's gripper controller did: the
// newest command holds, without a result; a goal in progress is cancelled by it, as by another goal. A
// negative max_effort, PR2's "no limit", is the controller's own max_effort.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "doppel/control/controllers/detail/commanders.h"
#include "doppel/control/controllers/detail/pid.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {
namespace {

using control_msgs::action::GripperCommand;
using control_msgs::action::ParallelGripperCommand;

// The common base; subclasses provide the type of the action.
class GripperController : public Controller {
 public:
  explicit GripperController(GripperKind kind) : kind_(kind) {}
  void on_init(ControllerContext& context) override {
    context_ = &context;
    if (kind_ == GripperKind::parallel) settings_.max_effort = 10;
    declare_parameters(context, {{"joint", &settings_.joint, "the gripper's", read_only()}});
    if (settings_.joint.empty() || check_joints(context, "joint", {settings_.joint}).empty()) {
      throw InputError("control.empty_parameter", place_of(context, "joint"),
                       fmt::format("controller '{}' has no joint to drive", context.name),
                       "write joint: NAME below its ros__parameters");
    }
    declare_parameters(context, parameters());
    set_gains();
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

  [[nodiscard]] InterfaceConfiguration command_interfaces() const override {
    InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
    wanted.names.push_back(settings_.joint + "/" + (kind_ == GripperKind::effort ? kEffort : kPosition));
    for (const std::string* more : {&settings_.max_effort_interface, &settings_.max_velocity_interface}) {
      if (!more->empty()) wanted.names.push_back(*more);
    }
    return wanted;
  }

  [[nodiscard]] InterfaceConfiguration state_interfaces() const override {
    return {InterfaceConfiguration::Kind::individual,
            {settings_.joint + "/" + kPosition, settings_.joint + "/" + kVelocity}};
  }

  // Changed parameters take effect at the next configuration, as in ros2_controllers.
  Status on_configure() override {
    read_parameters(context_->node->parameters(), parameters());
    set_gains();
    return {};
  }

  Status on_activate() override {
    run_.position = state_handles[0].get();
    run_.velocity = state_handles[1].get();
    if (!std::isfinite(run_.position))
      return Status::refused(fmt::format("joint '{}' has no measured position yet", settings_.joint));
    hold_here();
    pid_.reset();
    run_.goal.reset();
    run_.ended.reset();
    run_.computed = 0;
    active_ = true;
    return {};
  }

  Status on_deactivate() override {
    active_ = false;
    abort_goals("the controller is deactivated");
    // An effort that is no longer controlled must not remain.
    if (kind_ == GripperKind::effort) command_handles[0].set(0.0);
    return {};
  }

  void update(Time now, Duration period) override {
    run_.position = state_handles[0].get();
    run_.velocity = state_handles[1].get();
    check_goal(now);
    drive(period);
  }

  void housekeeping(Time /*now*/) override {
    if (!run_.goal) return;
    if (!run_.ended) return feed_back(*run_.goal, {run_.position, run_.computed, false, false});
    const bool fine = run_.ended->reached || settings_.allow_stalling;
    const GoalId id = *run_.goal;
    const Outcome outcome = *run_.ended;
    run_.goal.reset();
    run_.ended.reset();
    if (!fine) {
      context_->log->warning(
          context_->name,
          fmt::format("the gripper stalled at {:.4g} on its way to {:.4g}; the goal is aborted",
                      outcome.position, run_.target));
    }
    finish(id, fine ? GoalStatus::succeeded : GoalStatus::aborted, outcome);
  }

  [[nodiscard]] double housekeeping_rate() const override { return settings_.action_monitor_rate; }

  [[nodiscard]] bool save(SavedSlot& slot) const override {
    value_in<Saved>(slot) = {run_, pid_.memory()};
    return true;
  }

  // A goal that was active then and has ended meanwhile continues as a motion, of which its client hears
  // nothing.
  void restore(const SavedPart& saved, Time now) override {
    const Saved* const before = value_of<Saved>(&saved);
    if (before == nullptr) return;
    if (run_.goal && run_.ended) housekeeping(now);
    if (run_.goal != before->run.goal) abort_goals(restored_reason(now));
    run_ = before->run;
    pid_.set_memory(before->pid);
  }

  void abort_goals(const std::string& why) override {
    if (!run_.goal) return;
    const Outcome present{run_.position, run_.computed, false, false};
    finish(*run_.goal, GoalStatus::aborted, run_.ended.value_or(present));
    run_.goal.reset();
    context_->log->warning(context_->name, "the goal is aborted: " + why);
  }

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

  Status accept(const GoalId& id, const Command& command) {
    if (Status taken = take(command); !taken) return taken;
    run_.goal = id;
    begin(id);
    return {};
  }

  // From now on the target, in place of a goal in progress.
  Status take(const Command& command) {
    const auto refuse = [this](const std::string& why) {
      context_->log->error(context_->name, why + "; the command is rejected");
      return Status::refused(why);
    };
    if (!active_) return refuse(fmt::format("'{}' is not active; activate it first", context_->name));
    if (!std::isfinite(command.position)) return refuse("the commanded position is not a finite number");
    if (std::isnan(command.effort.value_or(0)) || std::isnan(command.velocity.value_or(0)))
      return refuse("the commanded effort or velocity is not a number, so it cannot be limited");
    if (run_.goal)
      finish(*run_.goal, GoalStatus::canceled, {});  // preempted; an empty result, as in ros2_controllers
    run_.ended.reset();
    run_.goal.reset();
    run_.target = command.position;
    run_.max_effort = command.effort.value_or(settings_.max_effort);
    run_.max_velocity = command.velocity.value_or(settings_.max_velocity);
    run_.last_movement = context_->node->bus().now();
    if (kind_ == GripperKind::effort && run_.max_effort == 0 && !run_.error_logged) {
      run_.error_logged = true;
      context_->log->warning(context_->name,
                             "the command has max_effort 0, so the gripper does not move; set max_effort");
    }
    return {};
  }

  Status cancel(const GoalId& id) {
    if (run_.goal != id) return {};
    hold_here();
    finish(id, GoalStatus::canceled, {});
    run_.goal.reset();
    run_.ended.reset();
    return {};
  }

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
    std::vector<std::string> state_interfaces = {kPosition, kVelocity};
    PidGains gains;      // from position to effort
    double i_clamp = 0;  // magnitude of both ends of the integral term
  };

  // The state that changes while the controller runs.
  struct Run {
    bool error_logged = false;
    double target = 0, max_effort = 0, max_velocity = 0;
    double position = 0, velocity = 0;  // measured
    double computed = 0;                // the effort in a result
    std::optional<GoalId> goal;
    Time last_movement{};
    std::optional<Outcome> ended;  // of `goal`: set in the loop, reported between steps
  };
  struct Saved {
    Run run;
    PidMemory pid;
  };

  ControllerParameters parameters() {
    Settings& s = settings_;
    const bool parallel = kind_ == GripperKind::parallel;
    ControllerParameters list{
        {"action_monitor_rate", &s.action_monitor_rate, "Hz",
         parallel ? read_only(minimum(0.1)) : minimum(0.1)},
        {"goal_tolerance", &s.goal_tolerance, "position tolerance of the goal", minimum(0)},
        {"max_effort", &s.max_effort, "Max allowable effort", minimum(0)},
        {"allow_stalling", &s.allow_stalling, "a stall counts as success"},
        {"stall_velocity_threshold", &s.stall_velocity_threshold, "velocity below which the gripper stalls"},
        {"stall_timeout", &s.stall_timeout, "s below that velocity until it has stalled", minimum(0)}};
    if (parallel) {
      list.emplace_back("state_interfaces", &s.state_interfaces, "position and velocity", read_only());
      list.emplace_back("max_effort_interface", &s.max_effort_interface, "claimed if named", read_only());
      list.emplace_back("max_velocity_interface", &s.max_velocity_interface, "claimed if named", read_only());
      list.emplace_back("max_velocity", &s.max_velocity, "of a goal without max_effort", minimum(0));
    }
    if (kind_ == GripperKind::effort) {
      const std::pair<const char*, double*> gains[] = {
          {"p", &s.gains.p}, {"i", &s.gains.i}, {"d", &s.gains.d}, {"i_clamp", &s.i_clamp}};
      for (const auto& [name, value] : gains)
        list.emplace_back(fmt::format("gains.{}.{}", s.joint, name), value,
                          "of the PID from position to effort");
    }
    return list;
  }

  void set_gains() {
    PidGains gains = settings_.gains;
    gains.i_clamp_max = std::abs(settings_.i_clamp);
    gains.i_clamp_min = -gains.i_clamp_max;
    pid_.set_gains(gains);
  }

  void hold_here() {
    run_.target = run_.position;
    run_.max_effort = settings_.max_effort;
    run_.max_velocity = settings_.max_velocity;
  }

  void check_goal(Time now) {
    if (!run_.goal || run_.ended) return;
    if (std::abs(run_.target - run_.position) < settings_.goal_tolerance) {
      run_.ended = Outcome{run_.position, run_.computed, false, true};
    } else if (std::abs(run_.velocity) > settings_.stall_velocity_threshold || now < run_.last_movement) {
      run_.last_movement = now;
    } else if (to_seconds(now - run_.last_movement) > settings_.stall_timeout) {
      run_.ended = Outcome{run_.position, run_.computed, true, false};
    }
  }

  void drive(Duration period) {
    if (kind_ == GripperKind::effort) {
      const double most = std::abs(run_.max_effort);
      run_.computed = std::clamp(
          pid_.compute(run_.target - run_.position, -run_.velocity, to_seconds(period)), -most, most);
      command_handles[0].set(run_.computed);
      return;
    }
    command_handles[0].set(run_.target);
    if (kind_ == GripperKind::position) run_.computed = run_.max_effort;
    std::size_t next = 1;
    if (!settings_.max_effort_interface.empty()) command_handles[next++].set(run_.max_effort);
    if (!settings_.max_velocity_interface.empty()) command_handles[next].set(run_.max_velocity);
  }

  const GripperKind kind_;
  ControllerContext* context_ = nullptr;
  Settings settings_;
  Pid pid_;
  bool active_ = false;
  Run run_;
};

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

template <Action A>
class GripperActionController : public GripperController {
 public:
  using GripperController::GripperController;

 private:
  void open_action(Node& node) override {
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

  void begin(const GoalId& id) override { action_->set_executing(id); }

  void feed_back(const GoalId& id, const Outcome& outcome) override {
    typename A::Feedback feedback;
    fill(feedback, joint(), outcome);
    action_->publish_feedback(id, feedback);
  }

  void finish(const GoalId& id, GoalStatus status, const Outcome& outcome) override {
    typename A::Result result;
    if (status != GoalStatus::canceled) fill(result, joint(), outcome);  // a cancelled goal has no outcome
    action_->finish(id, status, result);
  }

  std::unique_ptr<ActionServer<A>> action_;
};

}  // namespace

std::unique_ptr<Controller> make_gripper_controller(GripperKind kind) {
  if (kind == GripperKind::parallel)
    return std::make_unique<GripperActionController<ParallelGripperCommand>>(kind);
  return std::make_unique<GripperActionController<GripperCommand>>(kind);
}

}  // namespace doppel
