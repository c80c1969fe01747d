#pragma once
// The accelerations that the drives of a model can give, from their effort limits, the inertia that they
// carry and gravity: what planners need and descriptions rarely have.
//
// First each joint alone, from rest: the least, over sampled configurations and drives, of what the drive's
// effort limit leaves after gravity, by the inertia that couples the two. Then all of them are scaled by the
// largest share for which every drive suffices in every sample, in whatever directions they accelerate at
// once. Of n joints the share is 1/n at least. Friction, damping and the torques of motion are not counted.

#include <Eigen/Core>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

inline constexpr int kAccelerationSamples = 1024;

enum class AccelerationKind {
  derived,      // it has a limit
  follows,      // a mimic joint: that of its leader by the multiplier
  no_effort,    // its drive has no effort limit
  cannot_hold,  // its effort limit does not hold it against gravity
  no_inertia,   // it moves no mass
  no_drive,     // fixed, or of several degrees of freedom
};

struct JointAcceleration {
  AccelerationKind kind = AccelerationKind::no_drive;
  double limit = kInfinity;  // rad/s^2 or m/s^2; infinite: there is none
  double alone = kInfinity;  // the same if no other joint accelerates
  // The drive's largest load at rest and largest inertia over all samples, with its mimics.
  double gravity = 0;  // N m or N
  double inertia = 0;  // kg m^2 or kg
};

struct AccelerationLimits {
  std::vector<JointAcceleration> joints;  // [joints of the model]
  double share = 1;                       // of what each joint may have alone
  int decisive = -1;  // the joint whose drive sets the share; -1: none, the joints do not disturb each other
};

// gravity: m/s^2, world axes. Joints without a limit are taken as still, and their drives do not count.
[[nodiscard]] DOPPEL_API AccelerationLimits acceleration_limits(const Model& model,
                                                                const Eigen::Vector3d& gravity);

}  // namespace doppel
