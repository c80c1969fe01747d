#pragma once
// The differences between the distributions of ROS 2 (ros/messages/distro.h) in ros2_control and
// ros2_controllers, as tables: controller types, parameters and defaults. Sources: the plugin lists, the
// parameter files and the migration guides of ros2_control 4.46.0, 5.16.0, 6.8.0 and ros2_controllers 4.42.1,
// 5.17.0, 6.9.0 (Jazzy, Kilted, Lyrical).

#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "doppel/export.h"
#include "doppel/ros/messages/distro.h"

namespace doppel {

struct ControllerTypeRow {
  std::string_view type;  // "position_controllers/JointGroupPositionController"
  DistroRange range = {};
  std::string_view instead = {};  // what to write where it is missing
};
// All types that a distribution has, also those that are not available here.
DOPPEL_API std::span<const ControllerTypeRow> ros2_controller_types();
// nullptr: a type of no distribution.
DOPPEL_API const ControllerTypeRow* find_ros2_type(std::string_view type);

struct ParameterRow {
  std::string_view package;    // of the controller's type: "diff_drive_controller"
  std::string_view parameter;  // '*' stands for any text: "gains.*.i_clamp"
  DistroRange range;
  std::string_view instead;
  std::string_view value = {};  // only this value of it is not in the others; empty: the parameter
};
// The row of a parameter of a controller, or of a value of it, that the process's distribution does not have;
// nullptr: it has it.
DOPPEL_API const ParameterRow* missing_parameter(std::string_view controller_type,
                                                 std::string_view parameter);
DOPPEL_API const ParameterRow* missing_value(std::string_view controller_type, std::string_view parameter,
                                             std::string_view value);

using DistroDefault = std::variant<bool, double, std::string_view>;
// The default of the process's distribution where it is not that of Jazzy; nullptr otherwise. The manager's
// package is "controller_manager".
DOPPEL_API const DistroDefault* changed_default(std::string_view controller_type, std::string_view parameter);

}  // namespace doppel
