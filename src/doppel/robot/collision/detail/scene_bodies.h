#pragma once
// The bodies of a CollisionScene as its contexts use them.

#include "doppel/robot/collision/collision_scene.h"
#include "doppel/robot/collision/detail/convex.h"

namespace doppel {

struct SolidShape {
  ShapeId id;
  Pose X_LS = Pose::Identity();  // in the link
  ConvexSolid solid;             // of a terrain: its bounds
  SharedField field = nullptr;   // of a terrain
  // With CollisionDetail::triangles.
  std::shared_ptr<void> surface = nullptr;
  Pose X_SG = Pose::Identity();  // the surface in the shape's frame
  bool is_mesh = false;
  // All vertices of a mesh with a surface, m, in the frame of the shape, whose solid may be a reduced hull.
  std::shared_ptr<const Eigen::Array<float, Eigen::Dynamic, 3>> vertices = nullptr;

  // An upper bound, within rounding, of how far the shape and its surface reach along d (unit), m, in the
  // shape's frame.
  [[nodiscard]] double extent(const Eigen::Vector3d& d) const;
};

// The ground has no shapes.
struct CollidingBody {
  BodyId id;
  std::size_t index = 0;  // in CollisionScene::Impl::bodies
  std::vector<SolidShape> shapes;
  // Bounding sphere in the link, m.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;
  std::size_t first_shape = 0;  // index of shapes[0] among all shapes of the scene
};

struct CollisionScene::Impl {
  std::vector<SceneInstance> instances;
  std::vector<CollidingBody> bodies;      // with shapes, and the ground; ascending
  std::vector<std::vector<int>> body_of;  // [instances][links] index into bodies; -1: no shape
  int ground = -1;                        // index into bodies; -1: none
  std::vector<std::pair<BodyId, BodyId>> tested;
  std::vector<std::pair<int, int>> tested_bodies;  // [tested] indices into bodies
  std::vector<AllowedPair> allowed;
  std::size_t shapes = 0;  // of all bodies

  [[nodiscard]] int find(BodyId body) const {
    if (body.is_ground()) return ground;
    return body_of.at(static_cast<std::size_t>(body.instance)).at(static_cast<std::size_t>(body.link));
  }
};

}  // namespace doppel
