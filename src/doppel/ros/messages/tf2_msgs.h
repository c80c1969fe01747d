#pragma once
// ROS 2's tf2_msgs: the message of /tf and /tf_static, and the action and service of a tf2 buffer.

#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel::tf2_msgs::msg {

struct TFMessage {
  std::vector<geometry_msgs::msg::TransformStamped> transforms;
  DOPPEL_MESSAGE("tf2_msgs/msg/TFMessage", transforms)
};

struct TF2Error {
  static constexpr std::uint8_t NO_ERROR = 0, LOOKUP_ERROR = 1, CONNECTIVITY_ERROR = 2,
                                EXTRAPOLATION_ERROR = 3, INVALID_ARGUMENT_ERROR = 4, TIMEOUT_ERROR = 5,
                                TRANSFORM_ERROR = 6;
  std::uint8_t error = 0;
  std::string error_string;
  DOPPEL_MESSAGE("tf2_msgs/msg/TF2Error", error, error_string)
  DOPPEL_CONSTANTS(NO_ERROR, LOOKUP_ERROR, CONNECTIVITY_ERROR, EXTRAPOLATION_ERROR, INVALID_ARGUMENT_ERROR,
                   TIMEOUT_ERROR, TRANSFORM_ERROR)
};

}  // namespace doppel::tf2_msgs::msg

namespace doppel::tf2_msgs::srv {

struct FrameGraph {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("tf2_msgs/srv/FrameGraph_Request")
  };
  struct Response {
    std::string frame_yaml;
    DOPPEL_MESSAGE("tf2_msgs/srv/FrameGraph_Response", frame_yaml)
  };
};

}  // namespace doppel::tf2_msgs::srv

namespace doppel::tf2_msgs::action {

struct LookupTransform {
  struct Goal {
    std::string target_frame, source_frame;
    builtin_interfaces::msg::Time source_time;
    builtin_interfaces::msg::Duration timeout;
    builtin_interfaces::msg::Time target_time;
    std::string fixed_frame;
    bool advanced = false;
    DOPPEL_MESSAGE("tf2_msgs/action/LookupTransform_Goal", target_frame, source_frame, source_time, timeout,
                   target_time, fixed_frame, advanced)
  };
  struct Result {
    geometry_msgs::msg::TransformStamped transform;
    msg::TF2Error error;
    DOPPEL_MESSAGE("tf2_msgs/action/LookupTransform_Result", transform, error)
  };
  struct Feedback {
    DOPPEL_EMPTY_MESSAGE("tf2_msgs/action/LookupTransform_Feedback")
  };
};

}  // namespace doppel::tf2_msgs::action
