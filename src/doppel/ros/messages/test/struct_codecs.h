#pragma once
// The compiled codecs of structs, of a list of types that has every kind of field: all types are read and
// written by the same templates. Nodes of the bus use them; types known by name are read by descriptions.

#include <span>
#include <vector>

#include "doppel/ros/messages/action_msgs.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/rcl_interfaces.h"
#include "doppel/ros/messages/rmw_dds_common.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/shape_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/ros/messages/type_description_interfaces.h"

namespace doppel::messages_testing {

// A struct's field of wide text, as rosidl has it.
struct Wide {
  std::u16string text;
  char16_t unit = 0;
  DOPPEL_MESSAGE("my_msgs/msg/Wide", text, unit)
};

struct StructCodec {
  const TypeSupport* type;
  Status (*recode)(std::span<const std::byte> cdr, Bytes& out);  // into the struct and out of it
};

template <Message M>
Status recode_struct(std::span<const std::byte> cdr, Bytes& out) {
  M message;
  Status status = from_cdr(cdr, message);
  if (status) out = to_cdr(message);
  return status;
}

template <Message... M>
std::vector<StructCodec> codecs_of() {
  return {{&type_support<M>(), &recode_struct<M>}...};
}

inline std::vector<StructCodec> struct_codecs() {
  using namespace std_msgs::msg;
  return codecs_of<Wide, Bool, Byte, Char, Empty, String, ByteMultiArray, Int8MultiArray, Int16MultiArray,
                   Int32MultiArray, Int64MultiArray, UInt16MultiArray, UInt32MultiArray, UInt64MultiArray,
                   Float32MultiArray, ColorRGBA, sensor_msgs::msg::JointState, sensor_msgs::msg::CameraInfo,
                   sensor_msgs::msg::PointCloud2, tf2_msgs::msg::TFMessage, shape_msgs::msg::SolidPrimitive,
                   rcl_interfaces::msg::ParameterEvent, rcl_interfaces::srv::DescribeParameters::Response,
                   rcl_interfaces::srv::SetParameters::Request, rmw_dds_common::msg::ParticipantEntitiesInfo,
                   std_srvs::srv::Trigger::Request, controller_manager_msgs::srv::ListControllers::Response,
                   controller_manager_msgs::srv::SwitchController::Request,
                   control_msgs::action::FollowJointTrajectory::Goal,
                   FeedbackMessage<control_msgs::action::FollowJointTrajectory>,
                   type_description_interfaces::srv::GetTypeDescription::Response>();
}

}  // namespace doppel::messages_testing
