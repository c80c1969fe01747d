#pragma once
// The plugins of a model of an SDF file that drive it or its joints, as controllers: such a model is a robot. Sources:
// gz-sim's systems DiffDrive, MecanumDrive, AckermannSteering, JointPositionController, JointController,
// JointTrajectoryController and JointStatePublisher; gazebo_ros_pkgs for the plugins of Gazebo Classic.

#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

struct MappedModel {
  std::string yaml;                 // the controllers, with their parameters
  std::vector<std::string> joints;  // that they command
  // Of the robot: that of a Classic plugin, which may be empty, or the model's name.
  std::string name_space;
};

// The topics are those of the plugins, or as Gazebo names them below /model/NAME and /world/NAME/model/NAME, where NAME
// is the description's name and that of the world. Notes say what is mapped. nullopt: nothing is, and notes say why.
DOPPEL_API std::optional<MappedModel> map_model_plugins(const RobotDescription& model,
                                                        const std::string& world, Diagnostics& diagnostics);

// The namespace of the plugins of gazebo_ros, as spawn_entity's robot_namespace sets it.
DOPPEL_API void set_plugin_namespace(RobotDescription& model, const std::string& name_space);

}  // namespace doppel
