// Types of plain values and geometry.

#include "doppel/ros/messages/ackermann_msgs.h"
#include "doppel/ros/messages/builtin_interfaces.h"
#include "doppel/ros/messages/detail/registry.h"
#include "doppel/ros/messages/detail/shape_msgs.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"

namespace doppel::messages_detail {

namespace {

void register_builtin_interfaces() {
  namespace msg = builtin_interfaces::msg;
  register_messages<msg::Time, msg::Duration>();
}

void register_std_msgs() {
  namespace msg = std_msgs::msg;
  register_messages<msg::Header, msg::Empty, msg::String, msg::Bool, msg::Int32, msg::Float64, msg::ColorRGBA,
                    msg::MultiArrayDimension, msg::MultiArrayLayout, msg::Float64MultiArray, msg::Byte,
                    msg::ByteMultiArray, msg::Char, msg::Float32, msg::Float32MultiArray, msg::Int16,
                    msg::Int16MultiArray, msg::Int32MultiArray, msg::Int64, msg::Int64MultiArray, msg::Int8,
                    msg::Int8MultiArray, msg::UInt16, msg::UInt16MultiArray, msg::UInt32,
                    msg::UInt32MultiArray, msg::UInt64, msg::UInt64MultiArray, msg::UInt8,
                    msg::UInt8MultiArray>();
}

void register_std_srvs() {
  namespace srv = std_srvs::srv;
  register_services<srv::Empty, srv::Trigger, srv::SetBool>();
}

void register_geometry_msgs() {
  namespace msg = geometry_msgs::msg;
  register_messages<msg::Point, msg::Vector3, msg::Quaternion, msg::Pose, msg::PoseStamped, msg::Transform,
                    msg::TransformStamped, msg::Twist, msg::TwistStamped, msg::Wrench, msg::WrenchStamped,
                    msg::Accel, msg::AccelStamped, msg::AccelWithCovariance, msg::AccelWithCovarianceStamped,
                    msg::Inertia, msg::InertiaStamped, msg::Point32, msg::PointStamped, msg::Polygon,
                    msg::PolygonInstance, msg::PolygonInstanceStamped, msg::PolygonStamped, msg::Pose2D,
                    msg::PoseArray, msg::PoseWithCovariance, msg::PoseWithCovarianceStamped,
                    msg::QuaternionStamped, msg::TwistWithCovariance, msg::TwistWithCovarianceStamped,
                    msg::Vector3Stamped, msg::VelocityStamped>();
}

void register_shape_msgs() {
  namespace msg = shape_msgs::msg;
  register_messages<msg::MeshTriangle, msg::Mesh, msg::Plane, msg::SolidPrimitive>();
}

void register_nav_msgs() {
  namespace msg = nav_msgs::msg;
  namespace srv = nav_msgs::srv;
  register_messages<msg::GridCells, msg::MapMetaData, msg::OccupancyGrid, msg::Odometry, msg::Path>();
  register_services<srv::GetMap, srv::GetPlan, srv::LoadMap, srv::SetMap>();
}

void register_ackermann_msgs() {
  namespace msg = ackermann_msgs::msg;
  register_messages<msg::AckermannDrive, msg::AckermannDriveStamped>();
}

void register_tf2_msgs() {
  namespace msg = tf2_msgs::msg;
  namespace srv = tf2_msgs::srv;
  namespace action = tf2_msgs::action;
  register_messages<msg::TFMessage, msg::TF2Error>();
  register_services<srv::FrameGraph>();
  register_actions<action::LookupTransform>();
}

void register_trajectory_msgs() {
  namespace msg = trajectory_msgs::msg;
  register_messages<msg::JointTrajectoryPoint, msg::JointTrajectory, msg::MultiDOFJointTrajectoryPoint,
                    msg::MultiDOFJointTrajectory>();
}

void register_rosgraph_msgs() {
  namespace msg = rosgraph_msgs::msg;
  register_messages<msg::Clock>();
}

}  // namespace

void register_standard_types() {
  register_builtin_interfaces();
  register_std_msgs();
  register_std_srvs();
  register_geometry_msgs();
  register_shape_msgs();
  register_nav_msgs();
  register_ackermann_msgs();
  register_tf2_msgs();
  register_trajectory_msgs();
  register_rosgraph_msgs();
}

}  // namespace doppel::messages_detail
