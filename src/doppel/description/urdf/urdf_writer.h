#pragma once
// A description that was not read from a URDF, as URDF text: links, joints and colours, for the readers of
// /robot_description.

#include <string>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/description/urdf/urdf_version.h"
#include "doppel/export.h"

namespace doppel {

// Meshes and textures are file:// URIs. Shapes that URDF does not have (ellipsoid, cone, plane, extrusion)
// and <gazebo>, <ros2_control> and transmissions are left out; a joint without limits of effort and velocity,
// which URDF requires, gets 1e16, as from sdformat. `newest`: the version that the readers know; a lower one
// is written if that is enough, and 1.0 without the attribute.
DOPPEL_API std::string write_urdf(const RobotDescription& robot, UrdfVersion newest);
DOPPEL_API std::string write_urdf(const RobotDescription& robot);  // for every parser: version 1.0

DOPPEL_API const char* joint_type_name(JointType type);  // "revolute", as URDF spells it

}  // namespace doppel
