#pragma once
// The names of plugins of simulators that have a replacement here: those under <ros2_control>, which doppel's
// simulated hardware replaces, and those of <gazebo> or a <model> that attach links to each other or drive them.

#include <optional>
#include <span>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

inline constexpr std::string_view kSimulatedPlugin = "doppel/SimulatedSystem";  // doppel's own

struct SimulatorPlugin {
  std::string_view name;
  std::string_view present;   // the present name of a former one; empty: the name is not obsolete
  std::string_view whose;     // the package or simulator, for messages
  bool needs_gazebo = false;  // runs inside a simulator and needs its <gazebo> plugin
};
DOPPEL_API std::span<const SimulatorPlugin> simulator_plugins();
// nullptr: not a simulator's name.
DOPPEL_API const SimulatorPlugin* find_simulator_plugin(std::string_view name);

enum class AttachmentPlugin { detachable_joint, vacuum_gripper };
// The plugin with this filename and name; nullopt: it does not attach anything.
DOPPEL_API std::optional<AttachmentPlugin> find_attachment_plugin(std::string_view filename,
                                                                  std::string_view name);

// True if it is a sensor by itself, outside of a <sensor>, by the filename of a <plugin> of Gazebo classic.
DOPPEL_API bool is_sensor_plugin(std::string_view filename);

// True if it is gz-sim's Label, the class of a model in pictures of labels.
DOPPEL_API bool is_label_plugin(std::string_view filename, std::string_view name);

// True if it drives a mobile base, by the filename and the name of a <plugin>.
DOPPEL_API bool drives_base(std::string_view filename, std::string_view name);

// Those of a <model> that drive its joints or publish them: gz-sim's JointPositionController, JointController,
// JointTrajectoryController and JointStatePublisher, and gazebo_ros's joint_state_publisher.
enum class JointPlugin { position, velocity, trajectory, states };
DOPPEL_API std::optional<JointPlugin> find_joint_plugin(std::string_view filename, std::string_view name);

}  // namespace doppel
