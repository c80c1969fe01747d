#pragma once
// ROS 2's geometry_msgs: metres, radians, newtons, newton metres, seconds.

#include "doppel/messages/std_msgs.h"

namespace doppel::geometry_msgs::msg {

struct Point {
  double x = 0, y = 0, z = 0;
  DOPPEL_MESSAGE("geometry_msgs/msg/Point", x, y, z)
};

struct Vector3 {
  double x = 0, y = 0, z = 0;
  DOPPEL_MESSAGE("geometry_msgs/msg/Vector3", x, y, z)
};

struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
  DOPPEL_MESSAGE("geometry_msgs/msg/Quaternion", x, y, z, w)
};

struct Pose {
  Point position;
  Quaternion orientation;
  DOPPEL_MESSAGE("geometry_msgs/msg/Pose", position, orientation)
};

struct PoseStamped {
  std_msgs::msg::Header header;
  Pose pose;
  DOPPEL_MESSAGE("geometry_msgs/msg/PoseStamped", header, pose)
};

struct Transform {
  Vector3 translation;
  Quaternion rotation;
  DOPPEL_MESSAGE("geometry_msgs/msg/Transform", translation, rotation)
};

struct TransformStamped {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  Transform transform;
  DOPPEL_MESSAGE("geometry_msgs/msg/TransformStamped", header, child_frame_id, transform)
};

struct Twist {
  Vector3 linear, angular;
  DOPPEL_MESSAGE("geometry_msgs/msg/Twist", linear, angular)
};

struct TwistStamped {
  std_msgs::msg::Header header;
  Twist twist;
  DOPPEL_MESSAGE("geometry_msgs/msg/TwistStamped", header, twist)
};

struct Wrench {
  Vector3 force, torque;
  DOPPEL_MESSAGE("geometry_msgs/msg/Wrench", force, torque)
};

struct WrenchStamped {
  std_msgs::msg::Header header;
  Wrench wrench;
  DOPPEL_MESSAGE("geometry_msgs/msg/WrenchStamped", header, wrench)
};

}  // namespace doppel::geometry_msgs::msg
