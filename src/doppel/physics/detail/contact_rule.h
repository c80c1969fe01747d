#pragma once
// The friction of a pair of shapes, the same for every engine.

#include <algorithm>

#include "doppel/physics/friction.h"
#include "doppel/physics/world.h"

namespace doppel {

struct PairFriction {
  double along = 0, across = 0;  // Coulomb
  double torsion = 0;            // m
  double slip = 0;               // m/s per N
  int directed = -1;             // 0 or 1: the shape whose direction counts; -1: `along` holds in every one
};

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
