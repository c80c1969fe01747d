#pragma once
// From a scenario to everything that must be known before anything is built: the description as the
// simulation wants it (use_sim), the controllers' files that belong to it, and the choices that were made on
// the user's behalf.

#include <filesystem>
#include <memory>
#include <vector>

#include "doppel/bus/parameter_file.h"
#include "doppel/core/diagnostic.h"
#include "doppel/description/load.h"
#include "doppel/export.h"
#include "doppel/twin/scenario.h"

namespace doppel {

struct RobotSetup {
  Target target;
  LoadedDescription description;
  ParameterFile controllers;       // generated where the package has none
  std::string controllers_origin;  // "config/ros2_controllers.yaml", for people; "generated"
  std::vector<std::filesystem::path> controllers_files;  // that it was read from; empty: generated
  std::vector<std::filesystem::path> declaring_files;    // of those found, which declare controllers
  bool controllers_named = false;                        // the user named the file
};

// A robot's target, found and expanded with its overlay. Throws InputError: nothing of that name, or what
// expand_description refuses.
struct ExpandedTarget {
  Target target;
  ExpandedDescription description;
};
DOPPEL_API ExpandedTarget expand_target(const Scenario& scenario, const WorldRobot& robot,
                                        PackageResolver& resolver, Diagnostics& diagnostics);

// Throws InputError. What was chosen without being asked for (use_sim:=true, generated controllers) are
// notes.
DOPPEL_API RobotSetup set_up_robot(const Scenario& scenario, const WorldRobot& robot,
                                   PackageResolver& resolver, Diagnostics& diagnostics);
// The same of a description that was read already, with no files of its own.
DOPPEL_API RobotSetup set_up_robot(const Scenario& scenario, const WorldRobot& robot,
                                   RobotDescription description, Diagnostics& diagnostics);

// The YAML that makes any robot move: a broadcaster, and a trajectory controller over `joints`.
// `velocity_states`: the hardware offers them.
DOPPEL_API std::string generated_controllers(const std::vector<std::string>& joints, bool velocity_states);

}  // namespace doppel
