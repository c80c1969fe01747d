#pragma once
// The parameters of ROS 2's joy_node and teleop_twist_joy_node, from their YAML, and the velocity that they give.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "doppel/messages/geometry_msgs.h"

namespace doppel::app {

class Joystick;

struct JoySettings {
  // joy_node
  double deadzone = 0.05, autorepeat_rate = 20.0;
  // teleop_twist_joy_node
  bool require_enable_button = true;
  bool inverted_reverse = false;  // the turn changes its direction when the base drives backward
  std::int64_t enable_button = 5, enable_turbo_button = -1;
  // By component: "x", "y", "z"; "yaw", "pitch", "roll". An axis of -1: none.
  std::map<std::string, std::int64_t> axis_linear{{"x", 5}, {"y", -1}, {"z", -1}},
      axis_angular{{"yaw", 2}, {"pitch", -1}, {"roll", -1}};
  std::map<std::string, double> scale_linear{{"x", 0.5}, {"y", 0}, {"z", 0}},
      scale_linear_turbo{{"x", 1.0}, {"y", 0}, {"z", 0}},
      scale_angular{{"yaw", 0.5}, {"pitch", 0}, {"roll", 0}},
      scale_angular_turbo{{"yaw", 1.0}, {"pitch", 0}, {"roll", 0}};
};

// Throws InputError for a file that cannot be read and for values of a wrong type; prints unknown names.
JoySettings read_joy_settings(const std::filesystem::path& file);
// The user's file, written by --calibrate: ~/.config/doppel/joy.yaml.
std::filesystem::path own_joy_file();
// The settings as YAML for both nodes.
std::string to_yaml(const JoySettings& settings);

// Whether the dead-man button (or turbo) is pressed.
bool is_enabled(const JoySettings& settings, const std::vector<bool>& buttons);
// The velocity of the base; zero while no button enables it.
geometry_msgs::msg::Twist joy_twist(const JoySettings& settings, const std::vector<double>& axes,
                                    const std::vector<bool>& buttons);

// Asks on the terminal for the axes and buttons. Throws ClientError if nothing is moved, or it is unplugged.
JoySettings calibrate_joystick(Joystick& joystick, JoySettings settings);

}  // namespace doppel::app
