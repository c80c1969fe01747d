// The loop's part of joint_trajectory_controller.h: nothing here allocates, locks or throws.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "doppel/control/controllers/detail/joint_trajectory_controller.h"
#include "doppel/control/controllers/detail/jtc_stop.h"
#include "doppel/control/hardware/nan.h"

namespace doppel {

using jtc::Kind;

namespace {
constexpr double kInstant = 0.5e-9;  // s; time is exact to the nanosecond, seconds as a double are not
}

void JointTrajectoryController::update(Time now, Duration period) {
  if (!active_) return;
  if (next_ != nullptr) take_next();
  interfaces_.read(state_);
  exchange_scaling();
  if (current_ != nullptr) follow(now, period);
  publish_controller_state(now);
}

void JointTrajectoryController::take_next() {
  if (next_ == received_.get()) std::swap(received_, followed_);
  current_ = std::exchange(next_, nullptr);
}

void JointTrajectoryController::exchange_scaling() {
  if (interfaces_.scaling_state) {
    const double factor = interfaces_.scaling_state->get();
    if (std::isfinite(factor) && factor >= 0) {
      scaling_ = factor;
    } else {
      scaling_unusable_ = true;
    }
  }
  if (interfaces_.scaling_command) interfaces_.scaling_command->set(scaling_command_);
}

void JointTrajectoryController::follow(Time now, Duration period) {
  const bool first = !current_->begun();
  if (first) {
    begin_trajectory(now);
  } else {
    trajectory_time_ += Duration(std::llround(static_cast<double>(period.count()) * scaling_));
  }
  // As in ros2_controllers, tolerances are checked against the desired state now, while the command is
  // sampled one period ahead, because it is in effect until the next update.
  const bool known = current_->sample(trajectory_time_, settings_.interpolation, desired_) &&
                     current_->sample(trajectory_time_ + period, settings_.interpolation, command_);
  reference_time_ = trajectory_time_ - current_->start_time();
  feedback_time_ = now - current_->start_time();
  if (!known) return;
  compute_errors();
  followed_goal_ = goal_.has_value();
  const Ending ending = check_goal(first);
  if (ending.kind != Ending::Kind::path_violated && ending.kind != Ending::Kind::goal_missed) {
    write_commands(now, period);
  }
  if (ending.kind != Ending::Kind::none) end_with(ending);
}

void JointTrajectoryController::begin_trajectory(Time now) {
  trajectory_time_ = now;
  if (settings_.interpolate_from_desired) {
    current_->begin(now, last_commanded_time_.value_or(now), last_commanded_, wraps_);
  } else {
    current_->begin(now, now, state_, wraps_);
  }
}

void JointTrajectoryController::compute_errors() {
  const bool velocities = settings_.measures(Kind::velocity) &&
                          (settings_.commands(Kind::velocity) || settings_.commands(Kind::effort));
  const bool accelerations = settings_.measures(Kind::acceleration) && settings_.commands(Kind::acceleration);
  for (std::size_t j = 0; j < settings_.joints.size(); ++j) {
    error_.positions[j] = wraps_[j]
                              ? jtc::shortest_angular_distance(state_.positions[j], desired_.positions[j])
                              : desired_.positions[j] - state_.positions[j];
    if (velocities) error_.velocities[j] = desired_.velocities[j] - state_.velocities[j];
    if (accelerations) error_.accelerations[j] = desired_.accelerations[j] - state_.accelerations[j];
  }
}

JointTrajectoryController::Ending JointTrajectoryController::check_goal(bool first) const {
  Ending ending;
  if (holding_) return ending;
  const bool before_end = trajectory_time_ < current_->end_time();
  jtc::Violation on_path, at_goal;
  for (std::size_t j = 0; j < settings_.joints.size(); ++j) {
    const auto check_joint = [&](const jtc::StateTolerance& tolerance, jtc::Violation& worst) {
      jtc::check(tolerance, j, error_.positions[j], error_.velocities[j], error_.accelerations[j], worst);
    };
    // The first sample is checked with the path tolerance even if it is the last point, so that a trajectory
    // whose only point is at time 0 cannot jump too far.
    if (before_end || first) check_joint(tolerances_.path[j], on_path);
    if (!before_end) check_joint(tolerances_.goal[j], at_goal);
  }
  ending.goal = goal_;
  ending.trajectory_time = to_seconds(reference_time_);
  ending.late = to_seconds(trajectory_time_ - current_->end_time());
  ending.worst = on_path.any() ? on_path : at_goal;
  if (on_path.any()) {
    ending.kind = Ending::Kind::path_violated;
  } else if (before_end) {
    return ending;
  } else if (at_goal.any() && tolerances_.goal_time > 0 && ending.late > tolerances_.goal_time + kInstant) {
    ending.kind = Ending::Kind::goal_missed;
  } else if (!at_goal.any() && goal_) {
    ending.kind = Ending::Kind::reached;
  } else if (cmd_timeout_ > 0 && ending.late > cmd_timeout_ + kInstant) {
    ending.kind = Ending::Kind::timed_out;
  }
  return ending;
}

void JointTrajectoryController::write_commands(Time now, Duration period) {
  for (std::size_t i = 0; i < pids_.size(); ++i) {
    const std::size_t j = joint_of_command_[i];
    const double effort = settings_.commands(Kind::effort) ? command_.effort[j] : 0.0;
    pid_command_[j] = tuning_.feedforward[j] * command_.velocities[j] + effort +
                      pids_[i].compute(error_.positions[j], error_.velocities[j], to_seconds(period));
  }
  const bool closed_loop = !pids_.empty();
  interfaces_.write(Kind::position, command_.positions);
  interfaces_.write(Kind::velocity, closed_loop ? pid_command_ : command_.velocities);
  interfaces_.write(Kind::acceleration, command_.accelerations);
  interfaces_.write(Kind::effort, closed_loop ? pid_command_ : command_.effort);
  last_commanded_ = command_;
  last_commanded_time_ = now;
}

void JointTrajectoryController::end_with(const Ending& ending) {
  (ending.goal ? goal_ended_ : topic_ended_) = ending;
  goal_.reset();
  if (ending.kind == Ending::Kind::reached) {
    jtc::Trajectory& hold = free_hold();
    jtc::make_success_hold(*current_, hold);
    next_ = &hold;
    holding_ = true;
  } else {
    stop();
  }
}

double JointTrajectoryController::followed_value(std::string_view interface) const {
  for (std::size_t i = 0; i < settings_.joints.size() && i < desired_.positions.size(); ++i) {
    const std::string& joint = settings_.joints[i];
    if (interface.starts_with(joint) && interface.substr(joint.size()) == "/position")
      return desired_.positions[i];
  }
  return kNaN;
}

void JointTrajectoryController::hold_at(std::span<const double> positions) {
  jtc::Trajectory& hold = free_hold();
  jtc::make_hold(settings_, positions, hold);
  next_ = &hold;
  holding_ = true;
}

// Stops as fast as the configuration permits: with deceleration, or by holding at once.
void JointTrajectoryController::stop() {
  if (!decelerates_) {
    hold_at(state_.positions);
    return;
  }
  holding_ = true;
  if (current_ == stop_.get()) {
    next_ = nullptr;  // already braking
    return;
  }
  jtc::make_stop(state_.positions, state_.velocities, settings_.max_deceleration, *stop_);
  next_ = stop_.get();
}

}  // namespace doppel
