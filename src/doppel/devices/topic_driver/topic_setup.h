#pragma once
// The setup of a component behind topics: its <param>s, by the names and defaults of
// topic_based_ros2_control, and those of its own. docs/hardware.md lists them.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/control/hardware/hardware.h"
#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API TopicJoint {
  std::string name;
  bool commanded = false;  // false: a mimic, or a joint that is only shown
  bool gripper = false;    // it is meant to stall
  double lower = 0, upper = 0, velocity = 0, effort = 0;
};

struct DOPPEL_API TopicSetup {
  std::string component;
  std::string commands = "/robot_joint_commands", states = "/robot_joint_states";
  double threshold = 1e-5;   // rad or m, below which a command is no news
  bool unwraps = false;      // states are angles of one turn, which are summed
  int max_lost_replies = 5;  // states that are missing, after which the joints hold
  double fault_after = 0.5;  // s without a whole state
  double max_delay = 0.2;    // s that a state may be later than the fastest one, by its stamp
  double ahead = 0.2;        // s of motion that a command may be ahead of the newest state
  bool gentle = false;       // a quarter of the speed
  std::vector<TopicJoint> joints;
};

// The plugin names of the driver.
[[nodiscard]] DOPPEL_API std::span<const std::string_view> topic_plugins();
[[nodiscard]] DOPPEL_API bool is_topic_plugin(std::string_view name);

// Throws InputError with all errors at their places.
[[nodiscard]] DOPPEL_API TopicSetup read_topic_setup(const HardwareDescription& description,
                                                     const Model& model, Diagnostics& diagnostics);

}  // namespace doppel
