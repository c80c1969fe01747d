#pragma once
// A place at which one joint may be let go of: the fall without friction, which is the fastest one, stays
// below kExcitationSpeed of the speed limit and within a span, with the distance in which the joint is
// caught.

#include <functional>
#include <string>

#include "doppel/review/identification/motion_plan.h"

namespace doppel::identification_detail {

struct FallingJoint {
  double low = 0, high = 0;  // rad or m, the span that is free
  double speed = 0;          // rad/s or m/s, the joint's limit; may be infinite
  double effort = 0;         // N m or N, the limit; may be infinite
  double friction = 0;       // N m or N, Coulomb
  bool slides = false;
  // At a position: what the drive exerts against gravity, N m or N; and the links' inertia, kg m^2 or kg.
  std::function<double(double)> load, inertia;
};

// Why there is no release; empty: `out` is set.
std::string plan_release(const FallingJoint& joint, PlannedRelease& out);

}  // namespace doppel::identification_detail
