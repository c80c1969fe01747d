#pragma once
// Which of the controllers' files that lie around a description are its own. Nobody named them, so none of
// them stops the robot.

#include <filesystem>
#include <string_view>
#include <vector>

#include "doppel/bus/parameter_file.h"
#include "doppel/core/diagnostic.h"
#include "doppel/description/load.h"

namespace doppel {

// The files that the description's <gazebo> plugins name. Where these name none that can be used, the one
// file in the folders config/ and controllers/ of the description's package, else of the packages beside it,
// whose controllers name most of the robot's joints; of equals the one with the fewest joints that it does
// not have, then one whose path holds the robot's name, one that a launch file of its package names, and one
// with a usual name (ros2_controllers.yaml, controllers.yaml), one whose path shares most words with the
// robot's name and the description's file. Empty: none is this robot's.
// Warnings: a plugin's file that does not exist, a file that cannot be read. Notes: which of several was
// taken and why, files of other robots.
std::vector<std::filesystem::path> find_controllers_files(const RobotDescription& robot, const Target& target,
                                                          Diagnostics& diagnostics);

// Whether the file is there, can be read and declares controllers for ROS 2.
bool is_controllers_file(const std::filesystem::path& file);

// A warning where the file declares controllers, but of managers in other namespaces alone. `manager`: the
// full name of the one that runs.
void report_other_managers(const ParameterFile& file, std::string_view manager, Diagnostics& diagnostics);

}  // namespace doppel
