#pragma once
// The friction of a pair of shapes, the same for every engine.

#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/physics/contract/world.h"
#include "doppel/robot/collision/friction.h"

namespace doppel {

struct PairFriction {
  double along = 0, across = 0;  // Coulomb
  double torsion = 0;            // m
  double slip = 0;               // m/s per N
  int directed = -1;             // 0 or 1: the shape whose direction counts; -1: `along` holds in every one
};

// The smaller of the two, as in Gazebo and ODE; a shape without one takes that of the other. nullopt: neither
// has one.
inline std::optional<double> combine(const std::optional<double>& a, const std::optional<double>& b) {
  return a && b ? std::min(a, b) : a ? a : b;
}

// An impact with a restitution as a step of semi-implicit Euler sees it.
struct Impact {
  double restitution = 0;  // 0..1
  double closing = 0;      // m/s along the normal at the step's start, positive
  double distance = 0;     // m at the step's start, negative: penetrating
  double pull = 0;         // m/s^2: the acceleration with which gravity closes the contact, not negative
};

// Approaches below this speed, m/s, end without a rebound, so that bodies come to rest: 2 cm/s and what
// gravity adds in two steps.
inline double min_rebound_speed(const Eigen::Vector3d& gravity, double step) {
  return 0.02 + 2.0 * gravity.norm() * step;
}

// The velocity along the normal, m/s, with which the step has to end so that the surfaces part with the
// restitution times the speed with which they meet. The step conserves v^2 / 2 + g x - h g v / 2, so the
// impact, which is seen up to a step late (or, with a distance, early), adds no energy; without that, bodies
// would never come to rest. What rises back out of a penetration is slower for it.
inline double rebound_speed(const Impact& impact, double h) {
  const double fallen = h * impact.pull;
  const double met = std::max(
      impact.closing * impact.closing + fallen * impact.closing + 2.0 * impact.pull * impact.distance, 0.0);
  const double parting =
      impact.restitution * impact.restitution * met - 2.0 * impact.pull * std::max(impact.distance, 0.0);
  return parting <= 0 ? 0.0 : std::sqrt(0.25 * fallen * fallen + parting) - 0.5 * fallen;
}

// The number of steps in which the penetration that an impact leaves is removed: the bodies part at a
// hundredth of the speed of the impact, which adds no rebound.
inline constexpr double kRecoverySteps = 100.0;

// The rule of the world: the larger or the smaller coefficient of the two. A shape that decides takes
// precedence. Torsion is the larger of the two, because a shape without a patch says nothing about it.
inline PairFriction combine(const Friction& a, const Friction& b, FrictionRule rule) {
  PairFriction out;
  out.torsion = std::max(a.torsion, b.torsion);
  out.slip = a.slip + b.slip;
  out.directed = a.directed() ? 0 : b.directed() ? 1 : -1;
  if (a.decides != b.decides) {
    const Friction& decides = a.decides ? a : b;
    out.along = decides.along;
    out.across = decides.across;
  } else if (a.decides || rule == FrictionRule::smaller) {
    out.along = std::min(a.along, b.along);
    out.across = std::min(a.across, b.across);
  } else {
    out.along = std::max(a.along, b.along);
    out.across = std::max(a.across, b.across);
  }
  return out;
}

}  // namespace doppel
