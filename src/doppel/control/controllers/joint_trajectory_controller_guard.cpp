// The guard of the hardware in joint_trajectory_controller.h, between steps: trajectories are checked as a
// whole, and wait until they have been rehearsed.

#include <algorithm>
#include <cmath>

#include "doppel/control/controllers/detail/joint_trajectory_controller.h"

namespace doppel {
namespace {

constexpr double kMoved = 0.1;  // rad or m from where a rehearsal began

}  // namespace

bool JointTrajectoryController::is_guarded() const {
  return context_->guard != nullptr && settings_.commands(jtc::Kind::position);
}

// The path as it will be followed from the present state.
void JointTrajectoryController::preview(const TrajectoryMessage& message,
                                        const std::function<void(const GuardedPath&)>& use) const {
  jtc::ReceivedTrajectory copy = trajectory_of(message);
  jtc::Trajectory& trajectory = *copy.get();
  if (settings_.interpolate_from_desired) {
    trajectory.begin(now(), run_.last_commanded_time.value_or(now()), run_.last_commanded, wraps_);
  } else {
    trajectory.begin(now(), now(), run_.state, wraps_);
  }
  const Time start = now();
  jtc::JointStates there(settings_.joints.size());
  use({settings_.joints, std::max(trajectory.end_time() - start, Duration{}),
       [&](Duration since, std::span<double> positions) {
         if (!trajectory.sample(start + since, settings_.interpolation, there)) return false;
         std::ranges::copy(there.positions, positions.begin());
         return true;
       }});
}

Status JointTrajectoryController::check_path(const TrajectoryMessage& message) const {
  Status out;
  if (is_guarded()) preview(message, [&](const GuardedPath& path) { out = context_->guard->check(path); });
  return out;
}

bool JointTrajectoryController::rehearse(Pending pending) {
  if (!is_guarded()) return false;
  preview(pending.message, [&](const GuardedPath& path) {
    pending.rehearsal = context_->guard->rehearse(path, from_seconds(1.0 / context_->update_rate));
  });
  if (pending.rehearsal == nullptr) return false;
  pending.begun = now();
  pending.positions = held_positions();
  pending_ = std::move(pending);
  return true;
}

bool JointTrajectoryController::has_moved_since(const Pending& pending) const {
  const std::vector<double> present = held_positions();
  for (std::size_t j = 0; j < present.size(); ++j) {
    if (std::abs(present[j] - pending.positions[j]) > kMoved) return true;
  }
  return false;
}

void JointTrajectoryController::attend_rehearsal() {
  if (!pending_) return;
  const std::optional<Status> outcome = pending_->rehearsal->outcome();
  if (!outcome) return;
  if (!*outcome) {
    context_->log->error(context_->name, "in the rehearsal " + outcome->why() +
                                             (pending_->goal ? "" : "; the trajectory is ignored"));
    return drop_pending("Rehearsal: " + outcome->why());
  }
  Pending passed = std::move(*pending_);
  pending_.reset();
  // A trajectory that has begun by its stamp begins later by the time of the rehearsal.
  auto& stamp = passed.message.header.stamp;
  const Time planned = from_msg(stamp);
  if (planned != Time{} && planned <= now()) stamp = to_time_msg(planned + (now() - passed.begun));
  // While another trajectory moves the robot, the rehearsal is repeated from where it is.
  if (has_moved_since(passed) && rehearse({passed.message, passed.goal, passed.tolerances})) return;
  if (passed.goal) {
    follow_goal(*passed.goal, passed.message, std::move(passed.tolerances));
  } else {
    adopt(passed.message);
  }
}

void JointTrajectoryController::drop_pending(const std::string& why) {
  if (!pending_) return;
  const std::optional<GoalId> goal = pending_->goal;
  pending_.reset();
  if (goal) finish(*goal, GoalStatus::aborted, FollowJointTrajectory::Result::INVALID_GOAL, why);
}

}  // namespace doppel
