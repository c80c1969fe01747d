#pragma once
// The input of a robot from a scenario: the description for the simulation (use_sim), its controllers' files,
// and the choices made on the user's behalf.

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/load.h"
#include "doppel/export.h"
#include "doppel/physics/contract/model_instance.h"
#include "doppel/ros/bus/parameter_file.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

// A controller of a base that the twin makes.
struct GeneratedBase {
  std::string name, text;                        // text: of the note that it was made
  std::vector<std::string> joints, free_joints;  // that it commands, and the casters
};

inline constexpr const char* kGeneratedOrigin = "generated";

struct RobotSetup {
  Target target;
  LoadedDescription description;
  std::shared_ptr<const ExpandedDescription> expanded = nullptr;  // nullptr: it was not read from a file
  XacroArguments arguments = {};                                  // of the expansion
  ParameterFile controllers;                                      // generated if the package has none
  std::string controllers_origin;  // for messages: "config/ros2_controllers.yaml" or "generated"
  std::vector<std::filesystem::path> controllers_files;  // the files it was read from; empty: generated
  std::vector<std::filesystem::path> declaring_files;    // found files that declare controllers
  bool controllers_named = false;                        // the user named the file
  bool from_plugins = false;                  // of a model of an SDF file: controllers from its plugins
  std::vector<std::string> free_joints = {};  // casters of a base: no controller holds them
  std::string unused_files;                   // of controllers of other robots; a note, or empty
  // Declared in `controllers`; started where the files that were found leave its joints without a controller.
  std::optional<GeneratedBase> spare_base;
  std::vector<std::string> generated;  // the YAML texts of the controllers that were generated
};

// A robot's target, found and expanded with its overlay. Throws InputError: there is no such target, or
// expand_description rejects it.
struct ExpandedTarget {
  Target target;
  ExpandedDescription description;
  XacroArguments arguments;  // with those that select simulation
};
DOPPEL_API ExpandedTarget expand_target(const Scenario& scenario, const WorldRobot& robot,
                                        PackageResolver& resolver, Diagnostics& diagnostics);

// Its description alone, without messages; nullopt: expand_target() throws InputError.
DOPPEL_API std::optional<ExpandedDescription> expanded_if_possible(const Scenario& scenario,
                                                                   const WorldRobot& robot);

// Throws InputError. Choices on the user's behalf (use_sim:=true, which controllers' file) are notes. Where there is
// no file, generate_controllers() follows.
DOPPEL_API RobotSetup set_up_robot(const Scenario& scenario, const WorldRobot& robot,
                                   PackageResolver& resolver, Diagnostics& diagnostics);
// The same for a description that is already read, without files.
DOPPEL_API RobotSetup set_up_robot(const Scenario& scenario, const WorldRobot& robot,
                                   RobotDescription description, Diagnostics& diagnostics);

// The setup of a model of an SDF file, by its plugins. Throws InputError: none of them is mapped.
DOPPEL_API RobotSetup set_up_model(const Scenario& scenario, const WorldRobot& robot,
                                   const std::string& world, RobotDescription description,
                                   Diagnostics& diagnostics);

// The controllers of a robot without a file: a broadcaster, a controller for a base with a plugin of Gazebo that
// drives it or on wheels that fit one, and a trajectory controller for the other joints. `made`: the robot's
// instance. With notes.
DOPPEL_API void generate_controllers(const Scenario& scenario, const WorldRobot& robot,
                                     const ModelInstance& made, RobotSetup& setup, Diagnostics& diagnostics);

// Adds a controller for the wheels of a robot to the files that were found for it: RobotSetup::spare_base.
DOPPEL_API void add_spare_base(const ModelInstance& made, RobotSetup& setup);

}  // namespace doppel
