#pragma once
// Controllers' files of ros_control, of ROS 1, as those of ros2_control: a robot of ROS 1 drives by its own YAML. The
// bases are mapped (diff_drive_controller, mecanum_drive_controller, ackermann_steering_controller and
// steer_drive_controller, which steer one virtual wheel), and the controllers that have the same parameters in both.
// Sources of the parameters and defaults: wiki.ros.org/diff_drive_controller and ros_controllers 0.21 of Noetic.

#include <filesystem>
#include <optional>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel {

// True if the text contains a section of parameters in the form of ROS 2.
DOPPEL_API bool has_ros2_parameters(const std::string& yaml);

// The file `name` with the text `yaml`; nullopt: it declares no controller of ROS 1. Controllers may be at the top
// level or below a namespace, which is not kept. A wheel separation or radius that is not given follows from the
// description, as in ROS 1: from the origins of the first wheels' joints, and the cylinder or sphere of the wheel.
// $(arg NAME) of a launch file is empty. Each controller is a note with what was derived; each one without a
// counterpart, and each parameter without one, a warning with its place. Throws InputError: the YAML is not well-formed.
DOPPEL_API std::optional<ParameterFile> ros1_controllers(const std::string& yaml, const std::string& name,
                                                         const RobotDescription& robot,
                                                         Diagnostics& diagnostics);

// A controllers' file of either ROS. In one of ROS 2 without a section of a manager, as for the spawner of one
// controller, sections with a type declare themselves. Throws InputError: the YAML is not well-formed, or has no
// parameters.
DOPPEL_API ParameterFile parse_controllers(const std::string& yaml, const std::string& name,
                                           const RobotDescription& robot, Diagnostics& diagnostics);
// Throws InputError also where the file is unreadable.
DOPPEL_API ParameterFile load_controllers(const std::filesystem::path& file, const RobotDescription& robot,
                                          Diagnostics& diagnostics);

}  // namespace doppel
