#pragma once
// The <gazebo> extensions of a URDF in SDF: friction and contact of a link's collisions, its
// sensors, springs of joints, plugins of the whole model. Source: sdformat's parser_urdf.cc (libsdformat
// 14), and classic.gazebosim.org/tutorials?tut=ros_urdf.

#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"

namespace doppel {

struct XmlNode;

void write_gazebo_of_robot(const RobotDescription& robot, std::vector<XmlNode>& model);
// A link with a sensor has to be a body.
bool carries_sensor(const RobotDescription& robot, const std::string& link);
// `link` has its collisions already.
void write_gazebo_of_link(const RobotDescription& robot, const std::string& name, XmlNode& link,
                          Diagnostics& diagnostics);
void write_gazebo_of_joint(const RobotDescription& robot, const std::string& name, XmlNode& joint,
                           Diagnostics& diagnostics);

}  // namespace doppel
