// Types of sensors and visualisation.

#include "doppel/ros/messages/detail/registry.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/vision_msgs.h"
#include "doppel/ros/messages/visualization_msgs.h"

namespace doppel::messages_detail {

namespace {

void register_sensor_msgs() {
  namespace msg = sensor_msgs::msg;
  namespace srv = sensor_msgs::srv;
  register_messages<msg::JointState, msg::Image, msg::CompressedImage, msg::RegionOfInterest, msg::CameraInfo,
                    msg::BatteryState, msg::ChannelFloat32, msg::FluidPressure, msg::Illuminance, msg::Imu,
                    msg::Joy, msg::JoyFeedback, msg::JoyFeedbackArray, msg::LaserEcho, msg::LaserScan,
                    msg::MagneticField, msg::MultiDOFJointState, msg::MultiEchoLaserScan, msg::NavSatStatus,
                    msg::NavSatFix, msg::PointCloud, msg::PointField, msg::PointCloud2, msg::Range,
                    msg::RelativeHumidity, msg::Temperature, msg::TimeReference>();
  register_services<srv::SetCameraInfo>();
}

void register_diagnostic_msgs() {
  namespace msg = diagnostic_msgs::msg;
  namespace srv = diagnostic_msgs::srv;
  register_messages<msg::KeyValue, msg::DiagnosticStatus, msg::DiagnosticArray>();
  register_services<srv::AddDiagnostics, srv::SelfTest>();
}

void register_vision_msgs() {
  namespace msg = vision_msgs::msg;
  register_messages<msg::Point2D, msg::Pose2D, msg::BoundingBox2D, msg::ObjectHypothesis,
                    msg::ObjectHypothesisWithPose, msg::Detection2D, msg::Detection2DArray,
                    msg::BoundingBox3D, msg::Detection3D, msg::Detection3DArray>();
}

void register_visualization_msgs() {
  namespace msg = visualization_msgs::msg;
  namespace srv = visualization_msgs::srv;
  register_messages<msg::UVCoordinate, msg::MeshFile, msg::Marker, msg::MarkerArray, msg::ImageMarker,
                    msg::InteractiveMarkerControl, msg::MenuEntry, msg::InteractiveMarker,
                    msg::InteractiveMarkerFeedback, msg::InteractiveMarkerInit, msg::InteractiveMarkerPose,
                    msg::InteractiveMarkerUpdate>();
  register_services<srv::GetInteractiveMarkers>();
}

}  // namespace

void register_sensing_types() {
  register_sensor_msgs();
  register_diagnostic_msgs();
  register_vision_msgs();
  register_visualization_msgs();
}

}  // namespace doppel::messages_detail
