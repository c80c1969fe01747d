#pragma once
// ackermann_msgs: commands of vehicles with steered wheels (m, rad, s).

#include "doppel/ros/messages/std_msgs.h"

namespace doppel::ackermann_msgs::msg {

struct AckermannDrive {
  float steering_angle = 0, steering_angle_velocity = 0;  // rad, positive to the left; rad/s
  float speed = 0, acceleration = 0, jerk = 0;            // m/s and its derivatives
  DOPPEL_MESSAGE("ackermann_msgs/msg/AckermannDrive", steering_angle, steering_angle_velocity, speed,
                 acceleration, jerk)
};

struct AckermannDriveStamped {
  std_msgs::msg::Header header;
  AckermannDrive drive;
  DOPPEL_MESSAGE("ackermann_msgs/msg/AckermannDriveStamped", header, drive)
};

}  // namespace doppel::ackermann_msgs::msg
