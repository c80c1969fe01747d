#pragma once
// The present and former <plugin> names of simulators under <ros2_control>, which are replaced by
// doppel's simulated hardware.

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

}  // namespace doppel
