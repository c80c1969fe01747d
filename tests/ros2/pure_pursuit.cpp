#include "pure_pursuit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace doppel::ros2_testing {
namespace {

using geometry_msgs::msg::dds_::Twist_;

constexpr double kLookahead = 0.4;           // m
constexpr double kSpeed = 0.4;               // m/s
constexpr double kTurn = 0.8;                // rad/s
constexpr double kBraking = 0.4;             // m/s^2, towards the goal
constexpr double kAngularBraking = 0.8;      // rad/s^2
constexpr double kPositionTolerance = 0.02;  // m
constexpr double kHeadingTolerance = 0.02;   // rad
constexpr double kTurnsFirst = 0.8;          // rad, of the goal from the heading
constexpr double kAtRest = 0.01;             // m/s, rad/s

double seconds_of(const builtin_interfaces::msg::dds_::Time_& stamp) {
  return stamp.sec_() + stamp.nanosec_() * 1e-9;
}

double speed_to_stop_within(double distance, double braking, double most) {
  return std::clamp(std::sqrt(2 * braking * std::abs(distance)), 0.0, most);
}

double turn_to(double angle) {
  return std::copysign(std::max(0.05, speed_to_stop_within(angle, kAngularBraking, kTurn)), angle);
}

}  // namespace

double wrapped(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

PlanarPose planar(const geometry_msgs::msg::dds_::Point_& position,
                  const geometry_msgs::msg::dds_::Quaternion_& q) {
  return {position.x_(), position.y_(),
          std::atan2(2 * (q.w_() * q.z_() + q.x_() * q.y_()), 1 - 2 * (q.y_() * q.y_() + q.z_() * q.z_()))};
}

PurePursuit::PurePursuit(FastPeer& peer, Names names)
    : names_(std::move(names)),
      transforms_(peer.subscribe<tf2_msgs::msg::dds_::TFMessage_>("rt/tf", {.depth = 100})),
      odometry_(peer.subscribe<nav_msgs::msg::dds_::Odometry_>(names_.odometry)),
      goals_(peer.subscribe<geometry_msgs::msg::dds_::PoseStamped_>("rt/goal_pose")),
      velocity_(peer.advertise<geometry_msgs::msg::dds_::TwistStamped_>(names_.velocity)) {}

bool PurePursuit::is_connected() const {
  return transforms_.matched() > 0 && odometry_.matched() > 0 && velocity_.matched() > 0;
}

void PurePursuit::take_transforms() {
  while (const auto received = transforms_.take()) {
    for (const auto& transform : received->value.transforms_()) {
      if (transform.header_().frame_id_() != names_.odom_frame ||
          transform.child_frame_id_() != names_.base_frame)
        continue;
      const double stamp = seconds_of(transform.header_().stamp_());
      stale_transforms_ += stamp <= last_stamp_ ? 1 : 0;
      last_stamp_ = stamp;
      const auto& t = transform.transform_().translation_();
      geometry_msgs::msg::dds_::Point_ position;
      position.x_() = t.x_();
      position.y_() = t.y_();
      pose_ = planar(position, transform.transform_().rotation_());
    }
  }
}

void PurePursuit::take_goal() {
  while (const auto received = goals_.take()) {
    if (received->value.header_().frame_id_() != names_.odom_frame) continue;
    goal_ = planar(received->value.pose_().position_(), received->value.pose_().orientation_());
    start_.reset();
    is_near_ = arrived_ = false;
  }
}

Twist_ PurePursuit::velocity_to_goal() {
  Twist_ out;
  if (!start_) start_ = pose_;
  const double gx = goal_->x - pose_->x, gy = goal_->y - pose_->y;
  const double distance = std::hypot(gx, gy);
  is_near_ = is_near_ || distance < kPositionTolerance;
  if (is_near_) {
    const double error = wrapped(goal_->yaw - pose_->yaw);
    if (std::abs(error) < kHeadingTolerance) return out;
    out.angular_().z_() = turn_to(error);
    return out;
  }
  // The point of the line from start to goal that is the lookahead ahead of the base, at most the goal.
  const double lx = goal_->x - start_->x, ly = goal_->y - start_->y, length = std::hypot(lx, ly);
  const double along = ((pose_->x - start_->x) * lx + (pose_->y - start_->y) * ly) / length;
  const double at = std::min(along + kLookahead, length);
  const double px = start_->x + lx / length * at - pose_->x, py = start_->y + ly / length * at - pose_->y;
  const double x = std::cos(pose_->yaw) * px + std::sin(pose_->yaw) * py;
  const double y = -std::sin(pose_->yaw) * px + std::cos(pose_->yaw) * py;
  if (std::abs(std::atan2(y, x)) > kTurnsFirst) {
    out.angular_().z_() = turn_to(std::atan2(y, x));
    return out;
  }
  const double speed = std::max(0.03, speed_to_stop_within(distance, kBraking, kSpeed));
  out.linear_().x_() = speed;
  out.angular_().z_() = std::clamp(speed * 2 * y / (x * x + y * y), -kTurn, kTurn);
  return out;
}

bool PurePursuit::update() {
  take_transforms();
  take_goal();
  while (const auto received = odometry_.take()) {
    const auto& odometry = received->value;
    if (!goal_ || !pose_ || arrived_) continue;
    geometry_msgs::msg::dds_::TwistStamped_ command;
    command.header_().stamp_() = odometry.header_().stamp_();
    command.header_().frame_id_() = names_.base_frame;
    command.twist_() = velocity_to_goal();
    velocity_.publish(command);
    ++commands_;
    const auto& measured = odometry.twist_().twist_();
    const bool stops = command.twist_().linear_().x_() == 0 && command.twist_().angular_().z_() == 0;
    arrived_ = is_near_ && stops && std::abs(measured.linear_().x_()) < kAtRest &&
               std::abs(measured.angular_().z_()) < kAtRest;
  }
  return arrived_;
}

}  // namespace doppel::ros2_testing
