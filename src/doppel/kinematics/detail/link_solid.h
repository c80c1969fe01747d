#pragma once
// What a link's shapes would weigh if they were solid: the ground for what a description does not tell.

#include "doppel/description/robot_description.h"
#include "doppel/math/mass_properties.h"

namespace doppel {

constexpr double kAssumedDensity = 1000.0;  // kg/m^3: printed plastic with its screws and servos
constexpr double kMinSolidMass = 1e-6;      // kg: shapes that enclose less are not bodies

// The solids of the collision shapes, else of the visual ones, at kAssumedDensity, in the link frame. A mesh
// that is not closed counts as three tenths of its box. Mass 0: nothing is enclosed, or no mesh can be read.
MassProperties link_solid(const Link& link);

// Of kAssumedDensity, centred; the cylinder's axis is z. Lengths in m.
MassProperties solid_cylinder(double radius, double length);
MassProperties solid_ball(double radius);

}  // namespace doppel
