#include "app/verbs/identify_motions.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "app/verbs/shell.h"
#include "doppel/review/identification/excitation.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/doppel_msgs.h"

namespace doppel::app {
namespace {

using Follow = control_msgs::action::FollowJointTrajectory;

constexpr auto kCancelTime = std::chrono::seconds(2);
constexpr auto kCaughtTime = std::chrono::seconds(20);  // also of a slow simulation

Bytes goal_of(const MotionPart& part) {
  Follow::Goal goal;
  goal.trajectory.joint_names = part.arm->joints;
  for (const Waypoint& waypoint : part.path) {
    trajectory_msgs::msg::JointTrajectoryPoint point;
    for (const std::string& joint : part.arm->joints)
      point.positions.push_back(joint == part.joint ? waypoint.position : part.arm->held.at(joint));
    point.time_from_start = to_duration_msg(from_seconds(waypoint.time));
    goal.trajectory.points.push_back(std::move(point));
  }
  return to_cdr(goal);
}

}  // namespace

std::vector<Waypoint> slow_path(const ModelJoint& joint, double start, double target) {
  constexpr double kFreeSpeed = 2.0, kMinTime = 1.0, kRestTime = 0.5;  // rad/s or m/s, s
  const double limit = std::isfinite(joint.velocity) ? joint.velocity : kFreeSpeed;
  const double speed = kRehearsalSpeed * kExcitationSpeed * limit;
  const double time = std::max(kMinTime, std::abs(target - start) / speed);
  return {{kRestTime, start}, {kRestTime + time, target}, {2 * kRestTime + time, target}};
}

Motions::Motions(Client& twin, const RobotWatch& robot, std::string devices, std::string service,
                 std::deque<MotionPart> parts)
    : twin_(twin),
      robot_(robot),
      devices_(std::move(devices)),
      service_(std::move(service)),
      parts_(std::move(parts)) {}

void Motions::look(ClientRecorder& recorder) {
  GoalOutcome outcome;
  if (goal_ && !goal_->take_outcome(outcome)) return;
  if (goal_) {
    goal_.reset();
    end(outcome);
  }
  if (falls_ && Clock::now() > falls_until_) {
    falls_ = false;
    problem_ = fmt::format("the device does not report that '{}' is held again", joint_);
    parts_.clear();
  }
  if (falls_) return;
  if (parts_.empty()) return recorder.act(RecorderAction::stop);
  start(recorder);
}

void Motions::end(const GoalOutcome& outcome) {
  if (outcome.status == kSucceeded) {
    if (release_) release();
    return;
  }
  problem_ = fmt::format("the motion of '{}' ended with {}{}{}", joint_, status_name(outcome.status),
                         outcome.reason.empty() ? "" : ": ", outcome.reason);
  parts_.clear();
}

void Motions::take(const Client::Received& message) {
  if (message.topic != devices_) return;
  for (const auto& device : decode<doppel_msgs::msg::Devices>(message.cdr).devices) {
    for (const auto& joint : device.joints) {
      if (std::string_view(joint.name) != joint_) continue;
      const double off = to_seconds(from_msg(joint.torque_off));
      if (falls_ && off > before_ && !joint.released && to_seconds(from_msg(joint.torque_on)) > off) {
        falls_ = false;
        place_ = joint.goal;
        print_note(fmt::format("{}: caught at {:.3g}, {:.3g} s after the torque went off", joint_, joint.goal,
                               to_seconds(from_msg(joint.torque_on)) - off));
      }
      if (!falls_) before_ = off;
    }
  }
}

void Motions::cancel() {
  if (!goal_) return;
  goal_->cancel();
  GoalOutcome outcome;
  static_cast<void>(
      twin_.wait_until([&] { return goal_->take_outcome(outcome); }, Clock::now() + kCancelTime));
  goal_.reset();
}

void Motions::start(ClientRecorder& recorder) {
  MotionPart part = std::move(parts_.front());
  parts_.pop_front();
  if (part.joint != joint_) before_ = 0;
  joint_ = part.joint;
  release_ = part.release;
  if (part.target && place_) part.path = slow_path(*robot_.find(joint_), *place_, *part.target);
  place_.reset();
  recorder.act(part.rehearsal ? RecorderAction::pause : RecorderAction::resume);
  if (isatty(STDERR_FILENO) != 0) print_note("");
  print_note(fmt::format("{}: {} for {:.0f} s", part.joint,
                         part.rehearsal ? "slowly over its range"
                         : part.release ? "lifted for a release"
                         : part.target  ? "back to the pose"
                                        : "triangle, steps and harmonics",
                         part.path.back().time));
  goal_.emplace(twin_, part.arm->node + "/follow_joint_trajectory", action_support<Follow>(), goal_of(part));
  place_ = part.path.back().position;
}

// A device that refuses it is no error of the recording, but the phase is omitted.
void Motions::release() {
  doppel_msgs::srv::ReleaseJoint::Request request;
  request.joint = joint_;
  request.duration = release_->duration;
  request.lower = release_->lower;
  request.upper = release_->upper;
  request.speed = release_->speed;
  release_.reset();
  std::string why;
  try {
    const auto response = call<doppel_msgs::srv::ReleaseJoint>(twin_, service_, request);
    if (!response.success) why = response.message;
  } catch (const ClientError& error) {
    why = error.what();
  }
  if (why.empty()) {
    falls_ = true;
    falls_until_ = Clock::now() + kCaughtTime;
    return;
  }
  print_note(fmt::format("note: the release of '{}' is omitted: {}", joint_, why));
  std::erase_if(parts_, [&](const MotionPart& part) { return part.joint == joint_ && part.release; });
}

}  // namespace doppel::app
