#pragma once
// How the root of a robot stands in the world where nobody has said it: a robot on wheels or legs floats and
// is set on the ground, everything else is fixed.

#include <string>
#include <vector>

#include "doppel/description/robot_description.h"
#include "doppel/export.h"
#include "doppel/kinematics/model.h"

namespace doppel {

struct BaseChoice {
  BaseKind kind = BaseKind::fixed;
  // What the choice rests on, as the end of "because ...": "it has wheels ('left_wheel_joint',
  // 'right_wheel_joint')".
  std::string reason;
};

// Evidence for a floating base, in this order: a link `base_footprint` (REP 105's place for a mobile base); a
// plugin of a mobile base (diff_drive and its kin); two wheels, by name or by shape (joints without end,
// about a lying axis, of leaf links that are cylinders or spheres about that axis, of one radius); legs, by
// the names of what hangs on two moving joints or more. A link `world`, or a robot without a collision shape
// that is found, which could stand on nothing, is fixed.
DOPPEL_API BaseChoice choose_base(const RobotDescription& robot);

// The words of a name: "LHipYawPitch" and "l_hip_yaw_pitch" are both l, hip, yaw, pitch.
DOPPEL_API std::vector<std::string> words_of_name(const std::string& name);

}  // namespace doppel
