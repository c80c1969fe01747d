#pragma once
// Conversion of poses between Eigen and geometry_msgs; m, quaternions x y z w in messages.

#include <cmath>
#include <optional>
#include <string>

#include "doppel/base/math/pose.h"
#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel {

inline geometry_msgs::msg::Vector3 to_vector_msg(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
inline geometry_msgs::msg::Point to_point_msg(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}
inline Eigen::Vector3d from_msg(const geometry_msgs::msg::Vector3& v) {
  return {v.x, v.y, v.z};
}

inline geometry_msgs::msg::Pose to_pose_msg(const Pose& X) {
  const Eigen::Quaterniond rotation(X.linear());
  return {to_point_msg(X.translation()), {rotation.x(), rotation.y(), rotation.z(), rotation.w()}};
}

// nullopt if it is not a pose: a number that is not finite, or a zero quaternion.
inline std::optional<Pose> from_msg(const geometry_msgs::msg::Pose& pose) {
  const Eigen::Quaterniond rotation(pose.orientation.w, pose.orientation.x, pose.orientation.y,
                                    pose.orientation.z);
  Pose X = Pose::Identity();
  X.translation() << pose.position.x, pose.position.y, pose.position.z;
  if (!X.translation().allFinite() || !std::isfinite(rotation.norm()) || rotation.norm() < 1e-6)
    return std::nullopt;
  X.linear() = rotation.normalized().toRotationMatrix();
  return X;
}

inline void write_transform(const Pose& X, geometry_msgs::msg::Transform& out) {
  const geometry_msgs::msg::Pose pose = to_pose_msg(X);
  out.translation = {pose.position.x, pose.position.y, pose.position.z};
  out.rotation = pose.orientation;
}

inline geometry_msgs::msg::TransformStamped transform_of(const std::string& parent, const std::string& child,
                                                         const Pose& X_PC) {
  geometry_msgs::msg::TransformStamped out;
  out.header.frame_id = parent;
  out.child_frame_id = child;
  write_transform(X_PC, out.transform);
  return out;
}

}  // namespace doppel
