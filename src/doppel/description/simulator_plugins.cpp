#include "doppel/description/simulator_plugins.h"

#include <algorithm>
#include <array>

namespace doppel {
namespace {

constexpr std::array kPlugins{
    SimulatorPlugin{"gz_ros2_control/GazeboSimSystem", "", "Gazebo", true},
    SimulatorPlugin{"ign_ros2_control/IgnitionSystem", "gz_ros2_control/GazeboSimSystem", "Ignition Gazebo",
                    true},
    SimulatorPlugin{"gazebo_ros2_control/GazeboSystem", "gz_ros2_control/GazeboSimSystem",
                    "Gazebo Classic, which reached end of life in January 2025", true},
    SimulatorPlugin{"mock_components/GenericSystem", "", "ros2_control's mock components"},
    SimulatorPlugin{"fake_components/GenericSystem", "mock_components/GenericSystem",
                    "ros2_control before it was renamed"},
    SimulatorPlugin{"mujoco_ros2_control/MujocoSystem", "", "MuJoCo"},
    SimulatorPlugin{"topic_based_ros2_control/TopicBasedSystem", "", "Isaac Sim and others, by topics"},
    SimulatorPlugin{kSimulatedPlugin, "", "doppel"}};

// Part of a plugin's filename or name, which have the prefixes "lib", "gz-sim-", "ignition-gazebo-", "gz::sim::".
struct AttachmentName {
  std::string_view part;
  AttachmentPlugin plugin;
};
constexpr std::array kAttachmentNames{
    AttachmentName{"detachable-joint-system", AttachmentPlugin::detachable_joint},
    AttachmentName{"systems::DetachableJoint", AttachmentPlugin::detachable_joint},
    AttachmentName{"gazebo_ros_vacuum_gripper", AttachmentPlugin::vacuum_gripper}};

}  // namespace

std::span<const SimulatorPlugin> simulator_plugins() {
  return kPlugins;
}

const SimulatorPlugin* find_simulator_plugin(std::string_view name) {
  const auto found = std::ranges::find(kPlugins, name, &SimulatorPlugin::name);
  return found == kPlugins.end() ? nullptr : &*found;
}

std::optional<AttachmentPlugin> find_attachment_plugin(std::string_view filename, std::string_view name) {
  const auto found = std::ranges::find_if(kAttachmentNames, [&](const AttachmentName& of) {
    return filename.find(of.part) != std::string_view::npos || name.find(of.part) != std::string_view::npos;
  });
  return found == kAttachmentNames.end() ? std::nullopt : std::optional(found->plugin);
}

}  // namespace doppel
