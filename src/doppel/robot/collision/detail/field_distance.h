#pragma once
// The distance of a convex solid from a terrain, whose solid is below its surface.

#include "doppel/description/meshes/heightmap.h"
#include "doppel/robot/collision/detail/convex.h"

namespace doppel {

inline constexpr double kSolidBelow = 1.0;  // m, of the solid below the lowest point of a terrain

// The memory of field_distance(): used by one thread.
struct FieldWorkspace {
  FieldWorkspace();
  ConvexSolid prism;  // below a triangle of the terrain
};

// A is the terrain, X_AB: B in its frame. Apart: the distance from the prisms below the triangles near B.
// Overlapping: the greatest depth of B below a triangle, along its normal. `far` as of convex_distance().
ConvexDistance field_distance(const HeightField& field, const ConvexSolid& b, const Pose& X_AB, double far,
                              FieldWorkspace& cells, ConvexWorkspace& memory);

}  // namespace doppel
