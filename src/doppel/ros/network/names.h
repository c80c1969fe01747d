#pragma once
// ROS 2's names on the wire (design.ros2.org/articles/topic_and_service_names.html, rmw_fastrtps): "rt/",
// "rq/" and "rr/" before topics, requests and replies, "::dds_::" and a trailing underscore in types.

#include <optional>
#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel::ros2 {

enum class NameKind { topic, request, reply };  // "rt", "rq", "rr"

// "/joint_states" -> "rt/joint_states"; a service "/a/b" -> "rq/a/bRequest" and "rr/a/bReply".
DOPPEL_API std::string dds_name(NameKind kind, std::string_view ros_name);
// "sensor_msgs/msg/JointState" -> "sensor_msgs::msg::dds_::JointState_"; also "<pkg>/srv/<Name>_Request" and
// the types of actions.
DOPPEL_API std::string dds_type(std::string_view ros_type);

struct RosName {
  NameKind kind = NameKind::topic;
  std::string name;  // "/joint_states"; of a service without "Request" or "Reply"
};
DOPPEL_API std::optional<RosName> ros_name(std::string_view dds_name);      // nullopt: not of ROS 2
DOPPEL_API std::optional<std::string> ros_type(std::string_view dds_type);  // "sensor_msgs/msg/JointState"

}  // namespace doppel::ros2
