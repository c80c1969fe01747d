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
  if (run_.next != Source::none) take_next();
  interfaces_.read(run_.state);
  exchange_scaling();
  if (run_.current != Source::none) follow(now, period);
  publish_controller_state(now);
}

jtc::Trajectory* JointTrajectoryController::trajectory(Source source) {
  switch (source) {
    case Source::received:
      return run_.received.get();
    case Source::followed:
      return run_.followed.get();
    case Source::hold_0:
      return &run_.holds[0];
    case Source::hold_1:
      return &run_.holds[1];
    case Source::stop:
      return &run_.stop;
    case Source::none:
      break;
  }
  return nullptr;
}

void JointTrajectoryController::take_next() {
  if (run_.next == Source::received) {
    std::swap(run_.received, run_.followed);
    run_.next = Source::followed;
  }
  run_.current = std::exchange(run_.next, Source::none);
}

void JointTrajectoryController::exchange_scaling() {
  if (interfaces_.scaling_state) {
    const double factor = interfaces_.scaling_state->get();
    if (std::isfinite(factor) && factor >= 0) {
      run_.scaling = factor;
    } else {
      run_.scaling_unusable = true;
    }
  }
  if (interfaces_.scaling_command) interfaces_.scaling_command->set(run_.scaling_command);
}

void JointTrajectoryController::follow(Time now, Duration period) {
  const bool first = !current()->begun();
  if (first) {
    begin_trajectory(now);
  } else {
    run_.trajectory_time += Duration(std::llround(static_cast<double>(period.count()) * run_.scaling));
  }
  // As in ros2_controllers, tolerances are checked against the desired state now, while the command is
  // sampled one period ahead, because it is in effect until the next update.
  const bool known = current()->sample(run_.trajectory_time, settings_.interpolation, run_.desired) &&
                     current()->sample(run_.trajectory_time + period, settings_.interpolation, run_.command);
  run_.reference_time = run_.trajectory_time - current()->start_time();
  run_.feedback_time = now - current()->start_time();
  if (!known) return;
  compute_errors();
  run_.followed_goal = run_.goal.has_value();
  const Ending ending = check_goal(first);
  if (ending.kind != Ending::Kind::path_violated && ending.kind != Ending::Kind::goal_missed) {
    write_commands(now, period);
  }
  if (ending.kind != Ending::Kind::none) end_with(ending);
}

void JointTrajectoryController::begin_trajectory(Time now) {
  run_.trajectory_time = now;
  if (settings_.interpolate_from_desired) {
    current()->begin(now, run_.last_commanded_time.value_or(now), run_.last_commanded, wraps_);
  } else {
    current()->begin(now, now, run_.state, wraps_);
  }
}

void JointTrajectoryController::compute_errors() {
  const bool velocities = settings_.measures(Kind::velocity) &&
                          (settings_.commands(Kind::velocity) || settings_.commands(Kind::effort));
  const bool accelerations = settings_.measures(Kind::acceleration) && settings_.commands(Kind::acceleration);
  for (std::size_t j = 0; j < settings_.joints.size(); ++j) {
    run_.error.positions[j] =
        wraps_[j] ? jtc::shortest_angular_distance(run_.state.positions[j], run_.desired.positions[j])
                  : run_.desired.positions[j] - run_.state.positions[j];
    if (velocities) run_.error.velocities[j] = run_.desired.velocities[j] - run_.state.velocities[j];
    if (accelerations)
      run_.error.accelerations[j] = run_.desired.accelerations[j] - run_.state.accelerations[j];
  }
}

JointTrajectoryController::Ending JointTrajectoryController::check_goal(bool first) {
  Ending ending;
  if (run_.holding) return ending;
  const bool before_end = run_.trajectory_time < current()->end_time();
  jtc::Violation on_path, at_goal;
  for (std::size_t j = 0; j < settings_.joints.size(); ++j) {
    const auto check_joint = [&](const jtc::StateTolerance& tolerance, jtc::Violation& worst) {
      jtc::check(tolerance, j, run_.error.positions[j], run_.error.velocities[j], run_.error.accelerations[j],
                 worst);
    };
    // The first sample is checked with the path tolerance even if it is the last point, so that a trajectory
    // whose only point is at time 0 cannot jump too far.
    if (before_end || first) check_joint(run_.tolerances.path[j], on_path);
    if (!before_end) check_joint(run_.tolerances.goal[j], at_goal);
  }
  ending.goal = run_.goal;
  ending.trajectory_time = to_seconds(run_.reference_time);
  ending.late = to_seconds(run_.trajectory_time - current()->end_time());
  ending.worst = on_path.any() ? on_path : at_goal;
  if (on_path.any()) {
    ending.kind = Ending::Kind::path_violated;
  } else if (before_end) {
    return ending;
  } else if (at_goal.any() && run_.tolerances.goal_time > 0 &&
             ending.late > run_.tolerances.goal_time + kInstant) {
    ending.kind = Ending::Kind::goal_missed;
  } else if (!at_goal.any() && run_.goal) {
    ending.kind = Ending::Kind::reached;
  } else if (run_.cmd_timeout > 0 && ending.late > run_.cmd_timeout + kInstant) {
    ending.kind = Ending::Kind::timed_out;
  }
  return ending;
}

void JointTrajectoryController::write_commands(Time now, Duration period) {
  for (std::size_t i = 0; i < pids_.size(); ++i) {
    const std::size_t j = joint_of_command_[i];
    const double effort = settings_.commands(Kind::effort) ? run_.command.effort[j] : 0.0;
    run_.pid_command[j] =
        tuning_.feedforward[j] * run_.command.velocities[j] + effort +
        pids_[i].compute(run_.error.positions[j], run_.error.velocities[j], to_seconds(period));
  }
  const bool closed_loop = !pids_.empty();
  interfaces_.write(Kind::position, run_.command.positions);
  interfaces_.write(Kind::velocity, closed_loop ? run_.pid_command : run_.command.velocities);
  interfaces_.write(Kind::acceleration, run_.command.accelerations);
  interfaces_.write(Kind::effort, closed_loop ? run_.pid_command : run_.command.effort);
  run_.last_commanded = run_.command;
  run_.last_commanded_time = now;
}

void JointTrajectoryController::end_with(const Ending& ending) {
  (ending.goal ? run_.goal_ended : run_.topic_ended) = ending;
  run_.goal.reset();
  if (ending.kind == Ending::Kind::reached) {
    run_.next = free_hold();
    jtc::make_success_hold(*current(), *trajectory(run_.next));
    run_.holding = true;
  } else {
    stop();
  }
}

double JointTrajectoryController::followed_value(std::string_view interface) const {
  for (std::size_t i = 0; i < settings_.joints.size() && i < run_.desired.positions.size(); ++i) {
    const std::string& joint = settings_.joints[i];
    if (interface.starts_with(joint) && interface.substr(joint.size()) == "/position")
      return run_.desired.positions[i];
  }
  return kNaN;
}

void JointTrajectoryController::hold_at(std::span<const double> positions) {
  run_.next = free_hold();
  jtc::make_hold(settings_, positions, *trajectory(run_.next));
  run_.holding = true;
}

// Stops as fast as the configuration permits: with deceleration, or by holding at once.
void JointTrajectoryController::stop() {
  if (!decelerates_) {
    hold_at(run_.state.positions);
    return;
  }
  run_.holding = true;
  if (run_.current == Source::stop) {
    run_.next = Source::none;  // already braking
    return;
  }
  jtc::make_stop(run_.state.positions, run_.state.velocities, settings_.max_deceleration, run_.stop);
  run_.next = Source::stop;
}

}  // namespace doppel
