#pragma once
// The type of base of a robot for which neither the user nor the world file specifies one: a robot on wheels
// or legs floats and is placed on the ground, any other is fixed.

#include <string>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

struct BaseChoice {
  BaseKind kind = BaseKind::fixed;
  // The evidence, as the end of "because ...": "it has wheels ('left_wheel_joint', 'right_wheel_joint')".
  std::string reason;
};

// Evidence for a floating base, in this order: a link `base_footprint` (REP 105's frame of a mobile base); a
// plugin of a mobile base (diff_drive and similar); two wheels, by name or by shape (continuous joints about
// a horizontal axis, of leaf links that are cylinders or spheres about that axis, of the same radius); legs,
// by the names of links behind two or more moving joints (description/urdf/legs.h). A robot with a link `world`,
// or without any collision shape to stand on, is fixed. Does not throw.
DOPPEL_API BaseChoice choose_base(const RobotDescription& robot);

}  // namespace doppel
