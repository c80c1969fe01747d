#pragma once
// Finds the controllers' files of a description: one search for `up`, `check` and every other verb. The user
// did not name these files, so none of them prevents the start.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/load.h"
#include "doppel/export.h"
#include "doppel/ros/bus/parameter_file.h"
#include "doppel/scenario/resolve/controllers_file.h"

namespace doppel {

struct ControllersSearch {
  struct Missing {
    const GazeboPlugin* plugin;  // of the description; valid as long as it
    std::filesystem::path file;
    std::string did_you_mean;  // "; did you mean 'c.yaml'?"
    bool folder_there = false;
  };
  struct Unusable {
    std::filesystem::path file;
    const GazeboPlugin* plugin;  // that refers to it; nullptr: only found
    Diagnostics why;             // its errors, at least one
  };
  std::vector<ControllersFile> files;         // the robot's; may be empty
  std::optional<ControllersFile> of_another;  // if it is empty: the only one of the description's package
  std::vector<Missing> missing;               // references of plugins
  std::vector<Unusable> unusable;
  Diagnostics choices;  // notes: which of several is used and why, files of other robots
  Diagnostics skipped;  // notes: files that were not read
};

// The files to which the description's <gazebo> plugins refer ($(find NAME) is replaced, because a plain
// URDF may contain it). If none of these can be used: the file in the folders config/, controllers/ and bringup/ of
// the description's package, else of the packages next to it, whose controllers list most of the robot's
// joints. Ties are resolved in this order: the fewest joints that the robot does not have; a path with the
// robot's name; a launch file of its package refers to it; a usual name (ros2_controllers.yaml,
// controllers.yaml); most words in common between its path and the robot's name and the description's file. A
// file none of whose controllers finds its command interfaces in <ros2_control> is not used. Does not throw
// InputError.
DOPPEL_API ControllersSearch find_controllers_files(const RobotDescription& robot, const Target& target,
                                                    const PackageResolver& resolver);

// Reports the result of a search as warnings (up.controllers_missing, up.controllers_unreadable) and notes.
DOPPEL_API void report(const ControllersSearch& search, Diagnostics& diagnostics);

// True if the file exists, can be read and declares controllers for ROS 2.
DOPPEL_API bool is_controllers_file(const std::filesystem::path& file);

// A warning if the file declares controllers only for managers in other namespaces. `manager`: the full name
// of the running one.
DOPPEL_API void report_other_managers(const ParameterFile& file, std::string_view manager,
                                      Diagnostics& diagnostics);

}  // namespace doppel
