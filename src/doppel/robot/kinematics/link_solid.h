#pragma once
// The mass properties of a link's shapes as solids: the estimate for values that a description does not give.

#include "doppel/base/math/mass_properties.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

constexpr double kAssumedDensity = 1000.0;  // kg/m^3: printed plastic with its screws and servos
constexpr double kMinSolidMass = 1e-6;      // kg: shapes that enclose less are not solids

// The solid that a shape encloses at `density` (kg/m^3), in the shape's frame, m. A mesh that is not closed has
// three tenths of the volume of its bounding box. Mass 0: nothing is enclosed, or the mesh cannot be read.
DOPPEL_API MassProperties shape_solid(const Geometry& geometry, double density);

// The solids of the collision shapes, else of the visual ones, at kAssumedDensity, in the link frame. Mass
// 0: nothing is enclosed, or no mesh can be read.
DOPPEL_API MassProperties link_solid(const Link& link);

// Of kAssumedDensity, centred; the cylinder's axis is z. Lengths in m.
DOPPEL_API MassProperties solid_cylinder(double radius, double length);
DOPPEL_API MassProperties solid_ball(double radius);

}  // namespace doppel
