#pragma once
// Convex decomposition of static meshes for collision: it keeps interiors hollow, such as a room or the
// space below a table.

#include <vector>

#include "doppel/description/meshes/mesh.h"

namespace doppel {

inline constexpr double kShellThickness = 0.01;          // m, inwards
inline constexpr std::size_t kMaxShellTriangles = 1000;  // of a mesh: more of them are replaced by hulls

struct MeshParts {
  std::vector<std::vector<Eigen::Vector3f>> parts;  // m; each is the convex hull of its vertices
  std::size_t filled = 0;  // connected surfaces that are not convex and became their hull
  std::size_t joined = 0;  // connected surfaces that became one hull, because they are too many
};

// Each connected surface of the mesh: its vertices if it is convex; else a prism for each of its triangles; with too many
// triangles its hull.
MeshParts static_parts(const TriangleMesh& mesh);

inline constexpr std::size_t kMaxMovingParts = 100;  // of a mesh: more of them are replaced by one hull

// Of a mesh that moves: the vertices of each connected surface, whose hull has a volume and stays one body in contact.
MeshParts moving_parts(const TriangleMesh& mesh);

}  // namespace doppel
