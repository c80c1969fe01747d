#pragma once
// ROS 2's rosgraph_msgs: simulated time on /clock.

#include "doppel/ros/messages/builtin_interfaces.h"

namespace doppel::rosgraph_msgs::msg {

struct Clock {
  builtin_interfaces::msg::Time clock;
  DOPPEL_MESSAGE("rosgraph_msgs/msg/Clock", clock)
};

}  // namespace doppel::rosgraph_msgs::msg
