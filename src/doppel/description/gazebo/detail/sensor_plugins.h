#pragma once
// Plugins of Gazebo classic that are sensors, or change one. Source: gazebo_plugins of gazebo_ros_pkgs 2.9 (ROS 1) and
// 3.7 (ROS 2); hector_gazebo_plugins 0.5; velodyne_gazebo_plugins 1.0.

#include <optional>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/description/urdf/robot_description.h"

namespace doppel {

// A <plugin> inside of a <sensor>: its topics, frame and values replace those of the sensor. Notes, "sensor.plugin":
// a plugin that is not known, and values without effect.
void read_inner_plugin(const XmlNode& plugin, SensorDescription& sensor, Diagnostics& diagnostics);

// A <plugin> outside of a <sensor> that is a sensor by itself, on a body or a joint that it names. nullopt: it is none, or
// names no link or joint of the robot, which is a warning, "sensor.reference".
std::optional<SensorDescription> read_outer_plugin(const XmlNode& plugin, const RobotDescription& robot,
                                                   const std::string& reference, Diagnostics& diagnostics);

}  // namespace doppel
