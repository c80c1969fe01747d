#pragma once
// Names of a rig's sensors and of their topics.

#include <string>

#include "doppel/sensing/rig_sensor.h"

namespace doppel {

// "left/camera_link/camera": unique in a rig; of the sensor's random numbers.
std::string sensor_key(const RigSensor& sensor);
// The topic of an output; `own`: that of its kind.
std::string sensor_topic(const RigSensor& sensor, const std::string& output, const std::string& own);

}  // namespace doppel
