#pragma once
// The collision shapes of a model, in one list that engines, checks, exports and planners share.

#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/robot/collision/collision_shape.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

using LinkShapes = std::vector<std::vector<CollisionShape>>;  // [Model::links]

// The part of a mesh that collides: the hull of a robot's link, the triangles of what stands still in a
// world, or the hulls of the connected surfaces of what moves in it.
enum class MeshUse { hull, still, moving };

// `model` is compiled from `robot`. A mesh that cannot be read, or a shape without a size, is left out with a
// warning at its place; a size outside of the range of size_limits.h is an error "physics.size".
DOPPEL_API LinkShapes link_shapes(const RobotDescription& robot, const Model& model, MeshUse use,
                                  CollisionMeshes& meshes, Diagnostics& diagnostics);

// One shape: a primitive, or the mesh that was loaded for it. A plane is a slab below it.
DOPPEL_API CollisionShape collision_shape(const Geometry& geometry, const CollisionMesh* mesh,
                                          const Pose& X_LG, const Friction& friction);

}  // namespace doppel
