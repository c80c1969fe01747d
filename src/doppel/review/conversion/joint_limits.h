#pragma once
// The joint_limits.yaml of MoveIt: the speeds of the description, and accelerations that the drives can give.
// Source: moveit_setup_assistant, and joint_limits_common (MoveIt 2) for what is read.

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/robot/semantics/acceleration_limits.h"

namespace doppel {

// `model` is compiled from `robot`, and `limits` are derived from it. Accelerations are rounded down to four
// digits; those of a <limit> of URDF 1.2 count where they are lower, and its jerk is written. A joint that
// cannot hold its own weight is a warning "convert.cannot_hold".
DOPPEL_API std::string to_joint_limits(const RobotDescription& robot, const Model& model,
                                       const AccelerationLimits& limits, Diagnostics& diagnostics);

}  // namespace doppel
