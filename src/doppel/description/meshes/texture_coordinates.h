#pragma once
// Positions of a texture on shapes that are made of triangles.

#include <Eigen/Core>
#include <vector>

#include "doppel/description/meshes/mesh.h"
#include "doppel/export.h"

namespace doppel {

// For each corner of each triangle of `surface`, which is that of the shape (shape_mesh.h): the texture once around a
// cone and once along it, its base, and the ends of an extrusion as seen along z in metres; the sides of an extrusion by the
// length of the outline, in metres. Empty for the other kinds.
DOPPEL_API std::vector<Eigen::Vector2f> texture_coordinates(const Geometry& geometry,
                                                            const TriangleMesh& surface);

}  // namespace doppel
