#pragma once
// The plugins of Gazebo Classic and of gz-sim that drive a mobile base, mapped onto the controllers of ros2_control:
// for descriptions that have such a plugin and no controllers' file. The topics are those of the plugin, or, without
// one, those of PluginTopics.

#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// The namespace of the topics of a plugin.
enum class PluginTopics {
  relative,  // in the robot's namespace: cmd_vel (geometry_msgs/msg/Twist) and odom, as of the usual ros_gz_bridge
  // Of a model of an SDF world, as Gazebo names them: /model/NAME/cmd_vel and /model/NAME/odometry of gz-sim, cmd_vel
  // and odom in the plugin's <ros><namespace> of Gazebo Classic.
  of_model,
};

struct MappedBase {
  std::string name, type;           // of the controller
  std::string declaration;          // its entry below controller_manager, YAML with 4 blanks before the name
  std::string section;              // its own section
  std::vector<std::string> joints;  // that it commands
  std::string text;                 // how it was made: "wheels left and right, separation 0.4 m, ..."
};

// The joint that the controller needs and the robot does not offer, as the end of "it needs ..."; "" if there is none.
DOPPEL_API std::string missing_joint(const RobotDescription& robot, const MappedBase& base);

// The first plugin that can be mapped, with a note that says how; a note for each other one of a base. nullopt:
// there is none, or its joints have no velocity command in <ros2_control>.
DOPPEL_API std::optional<MappedBase> map_base_plugin(const RobotDescription& robot, PluginTopics topics,
                                                     Diagnostics& diagnostics);

// Of gazebo_ros, for Gazebo Classic.
DOPPEL_API bool is_classic(const GazeboPlugin& plugin);

}  // namespace doppel
