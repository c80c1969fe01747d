#pragma once
// Names of a rig's sensors and of their topics, as they are listed.

#include <string>

#include "doppel/sensors/rigs/rig_sensor.h"

namespace doppel {

// "left/camera_link/camera", or with the joint on which the sensor is: unique in a rig; of its random numbers.
std::string sensor_key(const RigSensor& sensor);
// The topic of an output; `own`: that of its kind.
std::string sensor_topic(const RigSensor& sensor, const std::string& output, const std::string& own);
// With all that is the same as long as the sensor runs, but its topics.
doppel_msgs::msg::Sensor listed(const RigSensor& sensor);

}  // namespace doppel
