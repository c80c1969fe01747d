#pragma once
// What a mesh collides as: a few hundred vertices whose convex hull is the mesh's, or a box where it is flat.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/description/robot_description.h"

namespace doppel {

struct CollisionMesh {
  std::size_t index = 0;                               // in the order of loading
  std::vector<Eigen::Vector3f> vertices;               // of the hull, m; empty: the box stands for it
  Eigen::Vector3d box_size = Eigen::Vector3d::Zero();  // full side lengths, m
  Pose X_GB = Pose::Identity();                        // the box in the mesh's frame
};

// Above this many vertices only those are kept that are extreme in one of kSupportDirections directions.
inline constexpr std::size_t kMostHullVertices = 500;
inline constexpr int kSupportDirections = 300;

// Flat means thinner than a ten-thousandth of its length: no hull can be computed, so a box of at least 1 mm
// stands in.
CollisionMesh make_collision_mesh(const std::vector<Eigen::Vector3f>& vertices);

// Loads every file once for each scale.
class CollisionMeshes {
 public:
  // Null: nothing to collide with (no file). Throws InputError from load_mesh. `owner` ("link 'arm'") and
  // `where` are for the warning "physics.flat_mesh".
  const CollisionMesh* find(const MeshGeometry& mesh, const std::string& owner, const SourceLocation& where,
                            Diagnostics& diagnostics);

 private:
  std::map<std::string, CollisionMesh> loaded_;  // by path and scale
};

}  // namespace doppel
