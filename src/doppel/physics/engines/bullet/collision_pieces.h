#pragma once
// Collision shapes as Bullet objects, immutable and shared by all states of a compilation, and ray
// casting against them.

#include <BulletCollision/CollisionShapes/btConvexShape.h>

#include <memory>
#include <vector>

#include "doppel/physics/contract/engine.h"
#include "doppel/physics/engines/bullet/convert.h"

namespace doppel {

// One shape of a link.
struct Piece {
  BodyId link;
  int group = 0;                 // rigid group of its instance
  Pose X_BS = Pose::Identity();  // in the frame of the group's body
  Friction friction;
  CollisionShape source;
  std::shared_ptr<btConvexShape> shape;
};

// Hulls of one mesh are made once.
class ShapeMaker {
 public:
  std::shared_ptr<btConvexShape> make(const CollisionShape& shape);

 private:
  std::vector<std::pair<SharedHull, std::shared_ptr<btConvexShape>>> hulls_;
};

// The distance from `from`, in units of the direction, to the first surface on the ray; negative: none. Both
// vectors are in the frame of the shape.
double ray_distance(const Piece& piece, const Eigen::Vector3d& from_S, const Eigen::Vector3d& direction_S);

// The points of a shape that may touch a plane first, in the shape's frame, m; `down_S` points to the plane.
void lowest_points(const Piece& piece, const Eigen::Vector3d& down_S, std::vector<Eigen::Vector3d>& out);

}  // namespace doppel
