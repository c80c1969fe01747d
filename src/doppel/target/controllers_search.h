#pragma once
// Which of the controllers' files that lie around a description are its own: one search for `up`, `check` and
// every other verb. Nobody named these files, so none of them stops the robot.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/bus/parameter_file.h"
#include "doppel/core/diagnostic.h"
#include "doppel/description/load.h"
#include "doppel/export.h"
#include "doppel/target/controllers_file.h"

namespace doppel {

struct ControllersSearch {
  struct Missing {
    const GazeboPlugin* plugin;  // of the description that was searched for
    std::filesystem::path file;
    std::string did_you_mean;  // "; did you mean 'c.yaml'?"
    bool folder_there = false;
  };
  struct Unusable {
    std::filesystem::path file;
    const GazeboPlugin* plugin;  // that names it; null: only found
    Diagnostics why;             // its errors, one at least
  };
  std::vector<ControllersFile> files;         // the robot's; empty: none is
  std::optional<ControllersFile> of_another;  // where none is: the only one of the description's package
  std::vector<Missing> missing;               // named by a plugin
  std::vector<Unusable> unusable;
  Diagnostics choices;  // notes: which of several was taken and why, files of other robots
  Diagnostics skipped;  // notes: what was not looked at
};

// The files that the description's <gazebo> plugins name ($(find NAME) is replaced, for a plain URDF may keep
// it). Where these name none that can be used, the one file in the folders config/ and controllers/ of the
// description's package, else of the packages beside it, whose controllers name most of the robot's joints;
// of equals the one with the fewest joints that it does not have, then one whose path holds the robot's name,
// one that a launch file of its package names, and one with a usual name (ros2_controllers.yaml,
// controllers.yaml), one whose path shares most words with the robot's name and the description's file.
DOPPEL_API ControllersSearch find_controllers_files(const RobotDescription& robot, const Target& target,
                                                    const PackageResolver& resolver);

// What was found on the way as warnings (up.controllers_missing, up.controllers_unreadable) and notes.
DOPPEL_API void report(const ControllersSearch& search, Diagnostics& diagnostics);

// Whether the file is there, can be read and declares controllers for ROS 2.
DOPPEL_API bool is_controllers_file(const std::filesystem::path& file);

// A warning where the file declares controllers, but of managers in other namespaces alone. `manager`: the
// full name of the one that runs.
DOPPEL_API void report_other_managers(const ParameterFile& file, std::string_view manager,
                                      Diagnostics& diagnostics);

}  // namespace doppel
