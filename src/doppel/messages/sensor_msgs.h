#pragma once
// ROS 2's sensor_msgs: the state of joints (rad or m, rad/s or m/s, N m or N).

#include "doppel/messages/std_msgs.h"

namespace doppel::sensor_msgs::msg {

struct JointState {
  std_msgs::msg::Header header;
  std::vector<std::string> name;
  std::vector<double> position, velocity, effort;
  DOPPEL_MESSAGE("sensor_msgs/msg/JointState", header, name, position, velocity, effort)
};

}  // namespace doppel::sensor_msgs::msg
