#pragma once
// The state interfaces of sensors. The names and their order are those of ros2_control's semantic components
// (controller_interface/semantic_components of Jazzy).

#include <string>
#include <vector>

#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/export.h"

namespace doppel {

// The names of a sensor's values, without its own: "linear_acceleration.x" (units of its message). Empty: it has none for
// controllers.
DOPPEL_API std::vector<std::string> reading_names(const SensorDescription& sensor);

}  // namespace doppel
