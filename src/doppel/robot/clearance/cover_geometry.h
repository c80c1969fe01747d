#pragma once
// The surface of one of a link's collision shapes, as written: the spheres of the link have to cover it.
//
// A mesh is its triangles, the thing that FCL judges, and not its hull; where its surface is closed it is
// solid. With CollisionDetail::hulls, and for objects without a description, it is the hull that the scene
// has. Primitives are solid; round ones are polyhedra around them, spheres themselves.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "doppel/description/meshes/mesh.h"
#include "doppel/export.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel {

struct CoverSphere {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, in the frame of the shape, link or body
  double radius = 0;                                 // m
};

struct DOPPEL_API CoverGeometry {
  std::vector<Eigen::Vector3d> vertices;  // m
  std::vector<std::array<std::uint32_t, 3>> triangles;
  bool closed = false;              // every edge has as many triangles on the one side as on the other
  std::optional<CoverSphere> ball;  // in the place of triangles
  // Triangles, or points and segments, whose sum with a ball of `rounding` is the surface or is around it;
  // empty: those above. For distances: of a capsule it is exact.
  std::vector<Eigen::Vector3d> core = {};
  double rounding = 0;  // m
};

[[nodiscard]] DOPPEL_API CoverGeometry cover_geometry(const TriangleMesh& mesh);
// One of the shapes of link_shapes.h, in the shape's frame. A terrain is the box around it.
[[nodiscard]] DOPPEL_API CoverGeometry cover_geometry(const CollisionShape& shape);

}  // namespace doppel
