#pragma once
// The input of a robot from a scenario: the description for the simulation (use_sim), its controllers' files,
// and the choices made on the user's behalf.

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
  ParameterFile controllers;       // generated if the package has none
  std::string controllers_origin;  // for messages: "config/ros2_controllers.yaml" or "generated"
  std::vector<std::filesystem::path> controllers_files;  // the files it was read from; empty: generated
  std::vector<std::filesystem::path> declaring_files;    // found files that declare controllers
  bool controllers_named = false;                        // the user named the file
  std::vector<std::string> free_joints = {};             // casters of a base: no controller holds them
};

// A robot's target, found and expanded with its overlay. Throws InputError: there is no such target, or
// expand_description rejects it.
struct ExpandedTarget {
  Target target;
  ExpandedDescription description;
};
DOPPEL_API ExpandedTarget expand_target(const Scenario& scenario, const WorldRobot& robot,
                                        PackageResolver& resolver, Diagnostics& diagnostics);

// Throws InputError. Choices on the user's behalf (use_sim:=true, generated controllers) are notes.
DOPPEL_API RobotSetup set_up_robot(const Scenario& scenario, const WorldRobot& robot,
                                   PackageResolver& resolver, Diagnostics& diagnostics);
// The same for a description that is already read, without files.
DOPPEL_API RobotSetup set_up_robot(const Scenario& scenario, const WorldRobot& robot,
                                   RobotDescription description, Diagnostics& diagnostics);

// YAML for a robot without controllers: a broadcaster, and a trajectory controller for `joints`.
// `velocity_states`: the hardware has velocity state interfaces. `base`: a controller that stands for a plugin of
// Gazebo (detail/base_plugins.h); nullptr: none.
struct MappedBase;
DOPPEL_API std::string generated_controllers(const std::vector<std::string>& joints, bool velocity_states,
                                             const MappedBase* base = nullptr);

}  // namespace doppel
