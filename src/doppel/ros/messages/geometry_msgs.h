#pragma once
// ROS 2's geometry_msgs: metres, radians, newtons, newton metres, seconds, kilograms. Covariances are 6 x 6,
// row by row, of x, y, z and the rotations about them.

#include "doppel/ros/messages/std_msgs.h"

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

struct Accel {
  Vector3 linear, angular;
  DOPPEL_MESSAGE("geometry_msgs/msg/Accel", linear, angular)
};

struct AccelStamped {
  std_msgs::msg::Header header;
  Accel accel;
  DOPPEL_MESSAGE("geometry_msgs/msg/AccelStamped", header, accel)
};

struct AccelWithCovariance {
  Accel accel;
  std::array<double, 36> covariance{};
  DOPPEL_MESSAGE("geometry_msgs/msg/AccelWithCovariance", accel, covariance)
};

struct AccelWithCovarianceStamped {
  std_msgs::msg::Header header;
  AccelWithCovariance accel;
  DOPPEL_MESSAGE("geometry_msgs/msg/AccelWithCovarianceStamped", header, accel)
};

struct Inertia {
  double m = 0;
  Vector3 com;
  double ixx = 0, ixy = 0, ixz = 0, iyy = 0, iyz = 0, izz = 0;
  DOPPEL_MESSAGE("geometry_msgs/msg/Inertia", m, com, ixx, ixy, ixz, iyy, iyz, izz)
};

struct InertiaStamped {
  std_msgs::msg::Header header;
  Inertia inertia;
  DOPPEL_MESSAGE("geometry_msgs/msg/InertiaStamped", header, inertia)
};

struct Point32 {
  float x = 0, y = 0, z = 0;
  DOPPEL_MESSAGE("geometry_msgs/msg/Point32", x, y, z)
};

struct PointStamped {
  std_msgs::msg::Header header;
  Point point;
  DOPPEL_MESSAGE("geometry_msgs/msg/PointStamped", header, point)
};

struct Polygon {
  std::vector<Point32> points;
  DOPPEL_MESSAGE("geometry_msgs/msg/Polygon", points)
};

struct PolygonInstance {
  Polygon polygon;
  std::int64_t id = 0;
  DOPPEL_MESSAGE("geometry_msgs/msg/PolygonInstance", polygon, id)
};

struct PolygonInstanceStamped {
  std_msgs::msg::Header header;
  PolygonInstance polygon;
  DOPPEL_MESSAGE("geometry_msgs/msg/PolygonInstanceStamped", header, polygon)
};

struct PolygonStamped {
  std_msgs::msg::Header header;
  Polygon polygon;
  DOPPEL_MESSAGE("geometry_msgs/msg/PolygonStamped", header, polygon)
};

struct Pose2D {
  double x = 0, y = 0, theta = 0;
  DOPPEL_MESSAGE("geometry_msgs/msg/Pose2D", x, y, theta)
};

struct PoseArray {
  std_msgs::msg::Header header;
  std::vector<Pose> poses;
  DOPPEL_MESSAGE("geometry_msgs/msg/PoseArray", header, poses)
};

struct PoseWithCovariance {
  Pose pose;
  std::array<double, 36> covariance{};
  DOPPEL_MESSAGE("geometry_msgs/msg/PoseWithCovariance", pose, covariance)
};

struct PoseWithCovarianceStamped {
  std_msgs::msg::Header header;
  PoseWithCovariance pose;
  DOPPEL_MESSAGE("geometry_msgs/msg/PoseWithCovarianceStamped", header, pose)
};

struct QuaternionStamped {
  std_msgs::msg::Header header;
  Quaternion quaternion;
  DOPPEL_MESSAGE("geometry_msgs/msg/QuaternionStamped", header, quaternion)
};

struct TwistWithCovariance {
  Twist twist;
  std::array<double, 36> covariance{};
  DOPPEL_MESSAGE("geometry_msgs/msg/TwistWithCovariance", twist, covariance)
};

struct TwistWithCovarianceStamped {
  std_msgs::msg::Header header;
  TwistWithCovariance twist;
  DOPPEL_MESSAGE("geometry_msgs/msg/TwistWithCovarianceStamped", header, twist)
};

struct Vector3Stamped {
  std_msgs::msg::Header header;
  Vector3 vector;
  DOPPEL_MESSAGE("geometry_msgs/msg/Vector3Stamped", header, vector)
};

struct VelocityStamped {
  std_msgs::msg::Header header;
  std::string body_frame_id, reference_frame_id;
  Twist velocity;
  DOPPEL_MESSAGE("geometry_msgs/msg/VelocityStamped", header, body_frame_id, reference_frame_id, velocity)
};

}  // namespace doppel::geometry_msgs::msg
