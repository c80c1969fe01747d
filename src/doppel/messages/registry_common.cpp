#include "doppel/messages/diagnostic_msgs.h"
#include "doppel/messages/registry_detail.h"
#include "doppel/messages/rosgraph_msgs.h"
#include "doppel/messages/sensor_msgs.h"
#include "doppel/messages/std_srvs.h"
#include "doppel/messages/tf2_msgs.h"
#include "doppel/messages/trajectory_msgs.h"
#include "doppel/messages/visualization_msgs.h"

namespace doppel::messages_detail {

void register_common_messages() {
  register_messages<builtin_interfaces::msg::Time, builtin_interfaces::msg::Duration>();
  register_messages<std_msgs::msg::Header, std_msgs::msg::Empty, std_msgs::msg::String, std_msgs::msg::Bool,
                    std_msgs::msg::Int32, std_msgs::msg::Float64, std_msgs::msg::ColorRGBA,
                    std_msgs::msg::MultiArrayDimension, std_msgs::msg::MultiArrayLayout,
                    std_msgs::msg::Float64MultiArray>();
  register_messages<geometry_msgs::msg::Point, geometry_msgs::msg::Vector3, geometry_msgs::msg::Quaternion,
                    geometry_msgs::msg::Pose, geometry_msgs::msg::PoseStamped, geometry_msgs::msg::Transform,
                    geometry_msgs::msg::TransformStamped, geometry_msgs::msg::Twist,
                    geometry_msgs::msg::TwistStamped, geometry_msgs::msg::Wrench,
                    geometry_msgs::msg::WrenchStamped>();
  register_messages<sensor_msgs::msg::JointState, sensor_msgs::msg::Image, sensor_msgs::msg::CompressedImage,
                    sensor_msgs::msg::RegionOfInterest, sensor_msgs::msg::CameraInfo>();
  register_messages<visualization_msgs::msg::UVCoordinate, visualization_msgs::msg::MeshFile,
                    visualization_msgs::msg::Marker, visualization_msgs::msg::MarkerArray>();
  register_messages<diagnostic_msgs::msg::KeyValue, diagnostic_msgs::msg::DiagnosticStatus,
                    diagnostic_msgs::msg::DiagnosticArray>();
  register_messages<tf2_msgs::msg::TFMessage, rosgraph_msgs::msg::Clock>();
  register_messages<trajectory_msgs::msg::JointTrajectoryPoint, trajectory_msgs::msg::JointTrajectory,
                    trajectory_msgs::msg::MultiDOFJointTrajectoryPoint,
                    trajectory_msgs::msg::MultiDOFJointTrajectory>();
  register_services<std_srvs::srv::Empty, std_srvs::srv::Trigger, std_srvs::srv::SetBool>();
}

}  // namespace doppel::messages_detail
