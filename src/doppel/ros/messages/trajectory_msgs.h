#pragma once
// ROS 2's trajectory_msgs: points of joints over time (rad or m and their derivatives, N m or N).

#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel::trajectory_msgs::msg {

struct JointTrajectoryPoint {
  std::vector<double> positions, velocities, accelerations, effort;
  builtin_interfaces::msg::Duration time_from_start;
  DOPPEL_MESSAGE("trajectory_msgs/msg/JointTrajectoryPoint", positions, velocities, accelerations, effort,
                 time_from_start)
};

struct JointTrajectory {
  std_msgs::msg::Header header;
  std::vector<std::string> joint_names;
  std::vector<JointTrajectoryPoint> points;
  DOPPEL_MESSAGE("trajectory_msgs/msg/JointTrajectory", header, joint_names, points)
};

struct MultiDOFJointTrajectoryPoint {
  std::vector<geometry_msgs::msg::Transform> transforms;
  std::vector<geometry_msgs::msg::Twist> velocities, accelerations;
  builtin_interfaces::msg::Duration time_from_start;
  DOPPEL_MESSAGE("trajectory_msgs/msg/MultiDOFJointTrajectoryPoint", transforms, velocities, accelerations,
                 time_from_start)
};

struct MultiDOFJointTrajectory {
  std_msgs::msg::Header header;
  std::vector<std::string> joint_names;
  std::vector<MultiDOFJointTrajectoryPoint> points;
  DOPPEL_MESSAGE("trajectory_msgs/msg/MultiDOFJointTrajectory", header, joint_names, points)
};

}  // namespace doppel::trajectory_msgs::msg
