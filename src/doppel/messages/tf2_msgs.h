#pragma once
// ROS 2's tf2_msgs: what goes over /tf and /tf_static.

#include "doppel/messages/geometry_msgs.h"

namespace doppel::tf2_msgs::msg {

struct TFMessage {
  std::vector<geometry_msgs::msg::TransformStamped> transforms;
  DOPPEL_MESSAGE("tf2_msgs/msg/TFMessage", transforms)
};

}  // namespace doppel::tf2_msgs::msg
