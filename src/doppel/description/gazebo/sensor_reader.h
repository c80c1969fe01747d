#pragma once
// Sensors from XML. What a description leaves out has SDFormat's default; what cannot be read is a warning at its place,
// with the default in its stead. Rules: "sensor.type" (unknown), "sensor.value", "sensor.reference", "sensor.name",
// "sensor.plugin", "sensor.preset".

#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// Of a robot: <gazebo reference="..."><sensor>, on a link or a joint, and plugins of Gazebo classic beside them that are
// sensors, in order. Without a reference a sensor is on the root link. Names of sensors are unique per link: a second one
// has "_2" behind its name, which is reported.
DOPPEL_API std::vector<SensorDescription> read_sensors(const RobotDescription& robot,
                                                       Diagnostics& diagnostics);

// One <sensor>, with the plugins of Gazebo classic in it. nullopt: of no known type, which is reported.
DOPPEL_API std::optional<SensorDescription> read_sensor(const XmlNode& sensor, const std::string& link,
                                                        Diagnostics& diagnostics);

}  // namespace doppel
