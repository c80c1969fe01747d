#pragma once
// The <plugin> names under <ros2_control> that simulators have or had, which doppel's simulated hardware
// stands in for.

#include <span>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

inline constexpr std::string_view kSimulatedPlugin = "doppel/SimulatedSystem";  // doppel's own

struct SimulatorPlugin {
  std::string_view name;
  std::string_view present;   // empty: the name is of today
  std::string_view whose;     // what it belonged to, for people
  bool needs_gazebo = false;  // lives inside a simulator and needs its <gazebo> plugin
};
DOPPEL_API std::span<const SimulatorPlugin> simulator_plugins();
// Null: no simulator's.
DOPPEL_API const SimulatorPlugin* find_simulator_plugin(std::string_view name);

}  // namespace doppel
