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

}  // namespace

std::span<const SimulatorPlugin> simulator_plugins() {
  return kPlugins;
}

const SimulatorPlugin* find_simulator_plugin(std::string_view name) {
  const auto found = std::ranges::find(kPlugins, name, &SimulatorPlugin::name);
  return found == kPlugins.end() ? nullptr : &*found;
}

}  // namespace doppel
