#pragma once
// The surfaces of shapes that not every consumer has a formula for, as closed convex meshes.

#include "doppel/description/meshes/mesh.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

inline constexpr int kRoundCorners = 32;  // corners of the polygon that replaces a circle

// Vertices in the shape's frame, m; triangles counter-clockwise seen from outside. The vertices of round
// shapes are on the surface, so that the mesh is inside of the shape.
DOPPEL_API TriangleMesh surface_mesh(const Ellipsoid& ellipsoid);
DOPPEL_API TriangleMesh surface_mesh(const Cone& cone);
DOPPEL_API TriangleMesh surface_mesh(const Extrusion& extrusion);

// Of an Ellipsoid, Cone or Extrusion; nullopt for the other kinds.
DOPPEL_API std::optional<TriangleMesh> convex_surface(const Geometry& geometry);

// The convex polygons, counter-clockwise, whose union is the simple polygon `outline` of either direction, m:
// ear clipping, then removal of the diagonals that are not needed (S. Hertel and K. Mehlhorn, "Fast
// triangulation of simple polygons", 1983). Empty: fewer than three corners, or no area.
DOPPEL_API std::vector<std::vector<Eigen::Vector2d>> convex_parts(
    const std::vector<Eigen::Vector2d>& outline);

}  // namespace doppel
