#include "doppel/control/controllers/detail/joint_trajectory_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/controllers/detail/jtc_stop.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {

using jtc::Kind;

JointTrajectoryController::JointTrajectoryController() = default;
JointTrajectoryController::~JointTrajectoryController() = default;

void JointTrajectoryController::on_init(ControllerContext& context) {
  context_ = &context;
  settings_ = jtc::declare_settings(context);
  if (const Status fits = jtc::read_tuning(context.node->parameters(), settings_, tuning_); !fits) {
    throw InputError("control.jtc_parameter", place_of(context, "joints"),
                     fmt::format("controller '{}': {}", context.name, fits.why()));
  }
  for (const std::string& joint : settings_.joints) {
    const int found = context.model->find_joint(joint);
    wraps_.push_back(found >= 0 &&
                     context.model->joints[static_cast<std::size_t>(found)].type == JointType::continuous);
  }
  context.node->parameters().on_change(
      [this](const std::string& name, const ParameterValue&) { take_tuning(name); });
  open_topics();
}

InterfaceConfiguration JointTrajectoryController::command_interfaces() const {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  for (const std::string& joint : settings_.command_joints) {
    for (const std::string& interface : settings_.command_interfaces)
      wanted.names.push_back(joint + "/" + interface);
  }
  if (!settings_.scaling_command.empty()) wanted.names.push_back(settings_.scaling_command);
  return wanted;
}

InterfaceConfiguration JointTrajectoryController::state_interfaces() const {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  for (const std::string& joint : settings_.joints) {
    for (const std::string& interface : settings_.state_interfaces)
      wanted.names.push_back(joint + "/" + interface);
  }
  if (!settings_.scaling_state.empty()) wanted.names.push_back(settings_.scaling_state);
  return wanted;
}

Status JointTrajectoryController::on_configure() {
  if (Status fits = jtc::check_configuration(settings_, joint_of_command_); !fits) return fits;
  if (Status fits = jtc::read_tuning(context_->node->parameters(), settings_, tuning_); !fits) return fits;
  jtc::warn_of_idle_settings(*context_, settings_, tuning_);
  run_.tolerances = tuning_.tolerances;
  const std::size_t joints = settings_.joints.size();
  for (jtc::JointStates* states :
       {&run_.state, &run_.desired, &run_.command, &run_.last_commanded, &run_.error}) {
    *states = jtc::JointStates(joints);
  }
  for (auto& hold : run_.holds) hold = jtc::Trajectory(joints, 1);
  run_.stop = jtc::Trajectory(joints, joints + 1);
  run_.pid_command.assign(joints, 0.0);
  pids_.assign(settings_.runs_pid() ? joint_of_command_.size() : 0, Pid{});
  for (std::size_t i = 0; i < pids_.size(); ++i) pids_[i].set_gains(tuning_.gains[joint_of_command_[i]]);
  run_.scaling = run_.scaling_command =
      settings_.commands_only(Kind::position) ? settings_.initial_scaling : 1.0;
  configure_deceleration();
  size_state_message();
  return {};
}

// If anything that braking needs is missing, the controller holds at once instead, with a warning; in
// ros2_controllers it does so without one.
void JointTrajectoryController::configure_deceleration() {
  decelerates_ = settings_.decelerate_on_cancel;
  if (!decelerates_) return;
  const auto fall_back = [this](std::string message, std::string fix) {
    decelerates_ = false;
    warn("control.jtc_no_deceleration",
         "decelerate_on_cancel has no effect, the controller will hold at once: " + message, std::move(fix));
  };
  if (!settings_.measures(Kind::velocity)) {
    fall_back("there is no measured velocity", "add velocity to state_interfaces");
  }
  for (std::size_t j = 0; j < settings_.joints.size(); ++j) {
    const std::string& joint = settings_.joints[j];
    if (settings_.max_deceleration[j] <= 0) {
      fall_back(fmt::format("joint '{}' has no deceleration", joint),
                fmt::format("write constraints.{}.max_deceleration_on_cancel", joint));
    }
    const int found = context_->model->find_joint(joint);
    const double limit = found < 0 ? 0.0 : context_->model->joints[static_cast<std::size_t>(found)].velocity;
    if (!(limit > 0) || !std::isfinite(limit)) {
      fall_back(fmt::format("joint '{}' has no velocity limit in the description", joint),
                "write <limit velocity> in the description");
    }
  }
}

Status JointTrajectoryController::on_activate() {
  if (Status bound = interfaces_.bind(settings_, joint_of_command_, command_handles, state_handles); !bound) {
    interfaces_.release();
    return bound;
  }
  seed_states();
  for (std::size_t j = 0; j < settings_.joints.size(); ++j) {
    if (std::isfinite(run_.state.positions[j])) continue;
    interfaces_.release();
    return Status::refused(fmt::format(
        "joint '{}' has no measured position yet, so it cannot be held where it is", settings_.joints[j]));
  }
  for (Pid& pid : pids_) pid.reset();
  run_.last_commanded_time.reset();
  run_.received.reset();
  run_.followed.reset();
  run_.current = run_.next = Source::none;
  hold_at(run_.state.positions);
  run_.cmd_timeout = tuning_.cmd_timeout > tuning_.tolerances.goal_time ? tuning_.cmd_timeout : 0.0;
  if (tuning_.cmd_timeout > 0 && run_.cmd_timeout == 0) {
    warn("control.jtc_idle_timeout",
         fmt::format(
             "cmd_timeout of {:g} s has no effect: it must be longer than constraints.goal_time, {:g} s",
             tuning_.cmd_timeout, tuning_.tolerances.goal_time),
         "increase cmd_timeout");
  }
  active_ = true;
  next_report_ = Time{};
  return {};
}

// As in ros2_controllers the last commands of another controller are the initial state by default. A servo
// that sags under load would otherwise be commanded to its sagged position.
void JointTrajectoryController::seed_states() {
  interfaces_.read(run_.state);
  if (settings_.seed_from_commands && settings_.command_joints.size() == settings_.joints.size()) {
    interfaces_.read_commands(run_.state);
  }
  run_.last_commanded = run_.state;
  run_.desired = run_.command = jtc::JointStates(settings_.joints.size());
  run_.desired.positions = run_.state.positions;
  run_.error = jtc::JointStates(settings_.joints.size());
  run_.reference_time = run_.feedback_time = Duration{};
}

Status JointTrajectoryController::on_deactivate() {
  active_ = false;
  abort_goals("Current goal cancelled during deactivate transition.");
  std::fill(run_.pid_command.begin(), run_.pid_command.end(), 0.0);
  for (const Kind kind : {Kind::velocity, Kind::acceleration, Kind::effort})
    interfaces_.write(kind, run_.pid_command);
  run_.current = run_.next = Source::none;
  run_.received.reset();
  run_.followed.reset();
  interfaces_.release();
  return {};
}

bool JointTrajectoryController::save(SavedSlot& slot) const {
  auto& [run, pids] = value_in<Saved>(slot);
  run = run_;
  pids.clear();
  for (const Pid& pid : pids_) pids.push_back(pid.memory());
  return true;
}

// A goal that was active then continues. If its client has had its answer meanwhile, the motion alone
// continues: the action's server ignores what is sent for a finished goal.
void JointTrajectoryController::restore(const SavedPart& saved, Time now) {
  const Saved* const before = value_of<Saved>(&saved);
  if (before == nullptr) return;
  report_endings();
  drop_pending(restored_reason(now));
  if (run_.goal != before->run.goal) abort_goals(restored_reason(now));
  run_ = before->run;
  for (std::size_t i = 0; i < std::min(pids_.size(), before->pids.size()); ++i)
    pids_[i].set_memory(before->pids[i]);
}

void JointTrajectoryController::abort_goals(const std::string& why) {
  report_endings();
  drop_pending(why);
  if (!run_.goal) return;
  finish(*run_.goal, GoalStatus::aborted, FollowJointTrajectory::Result::INVALID_GOAL, why);
  run_.goal.reset();
}

Status JointTrajectoryController::on_cleanup() {
  pids_.clear();
  tuning_ = {};
  return {};
}

void JointTrajectoryController::take_tuning(const std::string& changed) {
  if (const Status fits = jtc::read_tuning(context_->node->parameters(), settings_, tuning_); !fits) {
    context_->log->error(context_->name, fits.why() + "; the previous values stay in effect");
    return;
  }
  for (std::size_t i = 0; i < pids_.size(); ++i) pids_[i].set_gains(tuning_.gains[joint_of_command_[i]]);
  if (changed.starts_with("constraints.")) {
    warn("control.jtc_tolerances_later",
         fmt::format("'{}' applies from the next action goal on; the running trajectory, and trajectories "
                     "from the topic, keep their tolerances",
                     changed),
         "send the trajectory as an action goal, or configure the controller again");
  }
  if (changed.starts_with("gains.")) jtc::warn_of_idle_settings(*context_, settings_, tuning_);
}

void JointTrajectoryController::warn(const char* rule, std::string message, std::string fix) const {
  log_diagnostic(*context_->log, context_->name,
                 {Severity::warning, rule, std::move(message), {}, std::move(fix)});
}

}  // namespace doppel
