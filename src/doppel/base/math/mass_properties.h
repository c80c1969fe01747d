#pragma once
// Mass, centre of mass and inertia of rigid bodies and of the solids that meshes enclose.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "doppel/base/math/pose.h"
#include "doppel/export.h"

namespace doppel {

struct MassProperties {
  double mass = 0.0;                              // kg
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  // p_FoCo_F, m: centre of mass in the frame F of the input
  Eigen::Matrix3d I = Eigen::Matrix3d::Zero();    // kg m^2, about the centre of mass, in F's axes
};

// The same body in frame G; X_GF is F in G.
DOPPEL_API MassProperties transformed(const MassProperties& body_F, const Pose& X_GF);

// Two bodies fixed to each other, both in the same frame (parallel axis theorem).
DOPPEL_API MassProperties combined(const MassProperties& a, const MassProperties& b);

struct SolidProperties {
  double volume = 0.0;  // m^3, negative if the triangles face inwards
  MassProperties unit;  // of density 1 kg/m^3
};

// The solid enclosed by a closed triangle mesh. vertices: m, triangles: counter-clockwise seen from outside.
// Source: D. Eberly, "Polyhedral mass properties (revisited)", 2002.
DOPPEL_API SolidProperties solid_properties(std::span<const Eigen::Vector3f> vertices,
                                            std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace doppel
