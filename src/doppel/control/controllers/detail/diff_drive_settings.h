#pragma once
// The parameters of diff_drive_controller (ROS 2 Jazzy) that describe the base.

#include <string>
#include <vector>

#include "doppel/control/manager/controller.h"

namespace doppel {

struct DiffDriveSettings {
  std::vector<std::string> left, right;      // joints of the wheels; equal in number
  double separation = 0;                     // m, between the wheels of both sides, with its multiplier
  double left_radius = 0, right_radius = 0;  // m, with their multipliers
  bool open_loop = false;                    // odometry from the commands
  bool position_feedback = true;             // else from velocities
  Duration timeout{};                        // zero: never
  bool publish_limited_velocity = false;     // on ~/cmd_vel_out
  std::size_t window = 10;                   // velocities in the mean of the odometry
};

// Throws InputError for missing wheels or sizes and for unknown joints, at their place in the YAML.
void declare_diff_drive(ControllerContext& context);
// True if commands have stamps: `use_stamped_vel` of ROS 2 Humble, which Jazzy does not have. False: the
// controller reads geometry_msgs/msg/Twist on ~/cmd_vel_unstamped. Reported where a user's file sets it.
bool declare_stamped_commands(ControllerContext& context);
// The present values.
DiffDriveSettings diff_drive_settings(const Parameters& parameters);

}  // namespace doppel
