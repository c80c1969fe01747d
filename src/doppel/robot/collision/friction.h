#pragma once
// Coulomb friction of a collision shape, with a direction where it is not the same in every direction of the
// contact's tangent plane. Source: SDFormat 1.11, surface/friction.

#include <Eigen/Core>

#include "doppel/export.h"

namespace doppel {

inline constexpr double kDefaultFriction = 0.8;  // Coulomb, of a shape whose description has none

struct DOPPEL_API Friction {
  double along = kDefaultFriction;   // Coulomb, along `direction`, or in every direction
  double across = kDefaultFriction;  // Coulomb, across `direction`; equal to `along` without one
  // In the axes of the link `direction_link` of the same instance, -1: the shape's own; not normalised. Zero:
  // none. Its projection on the tangent plane counts.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  int direction_link = -1;
  // m: torque against rotation about the contact's normal over the normal force. Sliding and rotating share
  // one ellipsoid of friction, so that a wheel that pivots under load creeps sideways, as one of that width.
  double torsion = 0;
  // m/s per N: a contact under a tangential force creeps by it, before the force reaches the friction. The
  // compliances of a pair add up.
  double slip = 0;
  // Pairs of this shape have its friction, whatever the other one has; of two such shapes, the smaller. For a
  // caster, which stands for a rolling part, and for a shape with a direction.
  bool decides = false;
  bool written = false;  // the description has a coefficient

  [[nodiscard]] bool directed() const { return direction.squaredNorm() > 0; }
  // True if pairs of such shapes need no other rule than that of the larger friction.
  [[nodiscard]] bool plain() const { return !directed() && !decides && slip == 0; }
};

inline Friction uniform_friction(double coefficient) {
  Friction out;
  out.along = out.across = coefficient;
  out.written = true;
  return out;
}

}  // namespace doppel
