#pragma once
// Names of a rig's sensors and of their topics.

#include <string>

#include "doppel/sensing/rig_sensor.h"

namespace doppel {

// "left/camera_link/camera", or with the joint on which the sensor is: unique in a rig; of its random numbers.
std::string sensor_key(const RigSensor& sensor);
// The topic of an output; `own`: that of its kind.
std::string sensor_topic(const RigSensor& sensor, const std::string& output, const std::string& own);

}  // namespace doppel
