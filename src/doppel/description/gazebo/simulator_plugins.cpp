#include "doppel/description/gazebo/simulator_plugins.h"

#include <algorithm>
#include <array>
#include <string>

#include "doppel/base/core/text.h"

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

constexpr std::array<std::string_view, 12> kBaseNames{
    "diff_drive", "diffdrive",   "diff-drive", "skid_steer", "skidsteer",        "ackermann",
    "mecanum",    "planar_move", "tricycle",   "omni_drive", "velocity-control", "velocitycontrol"};

struct JointName {
  std::string_view part;
  JointPlugin plugin;
};
constexpr std::array kJointNames{JointName{"joint-position-controller-system", JointPlugin::position},
                                 JointName{"systems::JointPositionController", JointPlugin::position},
                                 JointName{"joint-trajectory-controller-system", JointPlugin::trajectory},
                                 JointName{"systems::JointTrajectoryController", JointPlugin::trajectory},
                                 JointName{"joint-controller-system", JointPlugin::velocity},
                                 JointName{"systems::JointController", JointPlugin::velocity},
                                 JointName{"joint-state-publisher-system", JointPlugin::states},
                                 JointName{"systems::JointStatePublisher", JointPlugin::states},
                                 JointName{"gazebo_ros_joint_state_publisher", JointPlugin::states}};

// With what is before and after them, so that "gazebo_ros_imu_sensor" is none.
constexpr std::array<std::string_view, 5> kSensorFiles{"gazebo_ros_imu.so", "gazebo_ros_ft_sensor.so",
                                                       "hector_gazebo_ros_imu.so", "hector_gazebo_ros_gps.so",
                                                       "hector_gazebo_ros_magnetic.so"};

// The entry with a part that the filename or the name contains; nullptr: none.
template <class Entries>
const auto* find_part(const Entries& entries, std::string_view filename, std::string_view name) {
  const auto found = std::ranges::find_if(entries, [&](const auto& of) {
    return filename.find(of.part) != std::string_view::npos || name.find(of.part) != std::string_view::npos;
  });
  return found == entries.end() ? nullptr : &*found;
}

}  // namespace

std::span<const SimulatorPlugin> simulator_plugins() {
  return kPlugins;
}

const SimulatorPlugin* find_simulator_plugin(std::string_view name) {
  const auto found = std::ranges::find(kPlugins, name, &SimulatorPlugin::name);
  return found == kPlugins.end() ? nullptr : &*found;
}

std::optional<AttachmentPlugin> find_attachment_plugin(std::string_view filename, std::string_view name) {
  const auto* const found = find_part(kAttachmentNames, filename, name);
  return found == nullptr ? std::nullopt : std::optional(found->plugin);
}

bool is_sensor_plugin(std::string_view filename) {
  return std::ranges::any_of(kSensorFiles, [&](std::string_view file) { return filename.ends_with(file); });
}

bool is_label_plugin(std::string_view filename, std::string_view name) {
  return filename.find("sim-label-system") != std::string_view::npos ||
         filename.find("gazebo-label-system") != std::string_view::npos || name.ends_with("systems::Label");
}

bool drives_base(std::string_view filename, std::string_view name) {
  const std::string text = lowered(std::string(filename) + ' ' + std::string(name));
  return std::ranges::any_of(kBaseNames,
                             [&](std::string_view part) { return text.find(part) != std::string::npos; });
}

std::optional<JointPlugin> find_joint_plugin(std::string_view filename, std::string_view name) {
  const auto* const found = find_part(kJointNames, filename, name);
  return found == nullptr ? std::nullopt : std::optional(found->plugin);
}

}  // namespace doppel
