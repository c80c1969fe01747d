#pragma once
// The parameters of ROS 2's joy_node and teleop_twist_joy_node (packages joy and teleop_twist_joy of Jazzy), and the
// velocity that they give.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/parameter_file.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {

inline constexpr const char *kJoyNode = "joy_node", *kTwistJoyNode = "teleop_twist_joy_node";

struct JoySettings {
  // joy_node
  std::int64_t device_id = 0;     // the number of the joystick, among those present
  std::string device_name;        // its name, which has priority
  double deadzone = 0.05;         // of an axis' range
  double autorepeat_rate = 20.0;  // Hz; 0: only changes are published
  bool sticky_buttons = false;
  std::int64_t coalesce_interval_ms = 1;  // for which further events of axes are awaited
  // teleop_twist_joy_node
  bool require_enable_button = true;
  bool inverted_reverse = false;  // the turn changes its direction when the base drives backward
  std::int64_t enable_button = 5, enable_turbo_button = -1;
  std::string frame = "teleop_twist_joy";     // of TwistStamped
  std::optional<bool> publish_stamped_twist;  // where it is written
  // The axes and scales by component: "x", "y", "z"; "yaw", "pitch", "roll". An axis of -1: none. Scales in
  // m/s and rad/s.
  std::map<std::string, std::int64_t> axis_linear{{"x", 5}, {"y", -1}, {"z", -1}},
      axis_angular{{"yaw", 2}, {"pitch", -1}, {"roll", -1}};
  std::map<std::string, double> scale_linear{{"x", 0.5}, {"y", 0}, {"z", 0}},
      scale_linear_turbo{{"x", 1.0}, {"y", 0}, {"z", 0}},
      scale_angular{{"yaw", 0.5}, {"pitch", 0}, {"roll", 0}},
      scale_angular_turbo{{"yaw", 1.0}, {"pitch", 0}, {"roll", 0}};

  bool operator==(const JoySettings&) const = default;
};

// Declare a node's parameters with the values written for it; `settings` follows each later change, and exists as long
// as the node. Read-only are those that the node uses only at its start: device_id, device_name; publish_stamped_twist,
// whose value is `stamped` unless another one is written. Throw InputError for a value of a wrong type or range.
DOPPEL_API void declare_joy(Node& node, ParameterOverrides& written, JoySettings& settings);
DOPPEL_API void declare_twist_joy(Node& node, ParameterOverrides& written, JoySettings& settings,
                                  bool stamped);

// The values of both nodes in a ROS 2 parameter file. Throws InputError for a file that cannot be read and for values of
// a wrong type; unknown names are warnings.
DOPPEL_API JoySettings read_joy_settings(const std::filesystem::path& file, Diagnostics& diagnostics);
// The settings as such a file: every parameter of both nodes, so that it reads back as the same settings.
DOPPEL_API std::string to_yaml(const JoySettings& settings);
// Throws InputError "teleop.would_be_lost" with the place of each section of other nodes and each unknown parameter of
// the file, which to_yaml() does not write.
DOPPEL_API void check_replaceable(const std::filesystem::path& file);

// When an unchanged state is published again after `last`; time_point::max(): never, also at less than 1e-9 Hz.
DOPPEL_API std::chrono::steady_clock::time_point next_repetition(const JoySettings& settings,
                                                                 std::chrono::steady_clock::time_point last);

// True if the dead-man button (or turbo) is pressed.
DOPPEL_API bool is_enabled(const JoySettings& settings, const sensor_msgs::msg::Joy& joy);
// The velocity of the base; zero while no button enables it.
DOPPEL_API geometry_msgs::msg::Twist joy_twist(const JoySettings& settings, const sensor_msgs::msg::Joy& joy);

}  // namespace doppel
