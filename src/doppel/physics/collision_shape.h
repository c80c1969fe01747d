#pragma once
// What a link collides as, for every engine alike: a primitive, or the convex hull of a mesh, and a box where
// the mesh is flat.

#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/description/robot_description.h"
#include "doppel/export.h"

namespace doppel {

struct CollisionHull {
  std::vector<Eigen::Vector3f> vertices;  // m; their convex hull is meant
};
using SharedHull = std::shared_ptr<const CollisionHull>;  // shapes of one mesh and scale share it

struct CollisionShape {
  std::variant<Box, Cylinder, Capsule, Sphere, SharedHull> geometry;
  Pose X_LS = Pose::Identity();  // in the link
  double friction = 0.8;         // Coulomb
};

// z of the shape's lowest point in a frame F in which it stands at X_FS, m.
DOPPEL_API double lowest_point(const CollisionShape& shape, const Pose& X_FS);

struct CollisionMesh {
  SharedHull hull;                                     // null: the box stands for it
  Eigen::Vector3d box_size = Eigen::Vector3d::Zero();  // full side lengths, m
  Pose X_GB = Pose::Identity();                        // the box in the mesh's frame
};

// Above this many vertices only those are kept that are extreme in one of kSupportDirections directions.
inline constexpr std::size_t kMaxHullVertices = 500;
inline constexpr int kSupportDirections = 300;

// Flat means thinner than a ten-thousandth of its length: no hull can be computed, so a box of at least 1 mm
// stands in.
DOPPEL_API CollisionMesh make_collision_mesh(const std::vector<Eigen::Vector3f>& vertices);

// Loads every file once for each scale.
class DOPPEL_API CollisionMeshes {
 public:
  // Null: nothing to collide with (no file). Throws InputError from load_mesh. `owner` ("link 'arm'") and
  // `where` are for the warning "physics.flat_mesh".
  const CollisionMesh* find(const MeshGeometry& mesh, const std::string& owner, const SourceLocation& where,
                            Diagnostics& diagnostics);

 private:
  std::map<std::string, CollisionMesh> loaded_;  // by path and scale
};

}  // namespace doppel
