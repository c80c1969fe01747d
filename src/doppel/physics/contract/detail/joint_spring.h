#pragma once
// A spring and a damper with bounded effort on one scalar joint during one step: a drive's servo, bounded by
// its effort limits, or a limit stop, which pushes and never pulls. Where the resulting effort would leave
// the bounds, the spring is replaced by the constant effort of that bound, without a damper, and the step is
// repeated; so the effort is always that of
//
//   tau = clip(feed + stiffness * (reference - q) + damping * (reference_velocity - v), low, high)
//
// at the velocity that the step arrives at and, under euler, the position that it starts from; under the
// schemes of higher order it is the mean over the step.

#include <algorithm>

#include "doppel/robot/kinematics/model.h"

namespace doppel {

struct JointSpring {
  int joint = -1, q = -1, v = -1;             // of the model; indices of its position and velocity
  bool on = false;                            // false: it exerts nothing
  double stiffness = 0, damping = 0;          // N m/rad, N m s/rad; or N/m, N s/m
  double reference = 0, reference_rate = 0;   // at the step's start, and how fast it moves: rad or m, per s
  double reference_velocity = 0;              // rad/s or m/s, in the damper's law
  double feed = 0;                            // N m or N
  double low = -kInfinity, high = kInfinity;  // N m or N
  int bound = 0;                              // -1 or 1: replaced by the constant effort `low` or `high`

  [[nodiscard]] bool acts_linearly() const { return on && bound == 0; }
  // Unbounded, at the time `t` after the step's start.
  [[nodiscard]] double law(double position, double velocity, double t) const {
    return feed + stiffness * (reference + reference_rate * t - position) +
           damping * (reference_velocity - velocity);
  }
  [[nodiscard]] double effort_at_bound() const { return bound < 0 ? low : high; }
};

// The bound that the effort of the unbounded law exceeds; 0: none.
inline int bound_of(const JointSpring& spring, double asked) {
  return asked > spring.high ? 1 : asked < spring.low ? -1 : 0;
}

}  // namespace doppel
