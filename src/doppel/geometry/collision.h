#pragma once
// Which links of a robot touch, and how deep. A link is what its <collision> elements specify: primitives as
// they are, meshes as their convex hulls or, where asked, by their own triangles. Not for the simulation,
// which has the engine's own; for judging a description and for self-collision matrices. Hulls and
// primitives: convex.h; triangles: the bounding volume trees of FCL (Pan, Chitta, Manocha 2012).

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "doppel/description/robot_description.h"
#include "doppel/export.h"
#include "doppel/math/pose.h"

namespace doppel {

// A primitive with positive measures, or a mesh whose file is known.
DOPPEL_API bool has_extent(const Geometry& geometry);

enum class CollisionDetail {
  hulls,      // every mesh as its convex hull: fast, solid; what physics uses
  triangles,  // the meshes' own surfaces; one that is wholly inside another touches nothing
};

struct LinkContact {
  int link_a = 0, link_b = 0;  // indices into RobotDescription::links, a < b
  double depth = 0;            // m, along the shortest way out; of hulls
};

class DOPPEL_API LinkCollider {
 public:
  // Meshes without a file, or that cannot be read, are left out, and so are primitives without a size.
  LinkCollider(const RobotDescription& robot, CollisionDetail detail);
  ~LinkCollider();
  LinkCollider(LinkCollider&&) noexcept;

  [[nodiscard]] bool has_shape(int link) const;
  // X_WL: every link's pose, by index into RobotDescription::links. Hulls that overlap by less than 1e-6 m
  // only lie on each other and do not touch.
  [[nodiscard]] bool touch(int link_a, int link_b, std::span<const Pose> X_WL) const;
  [[nodiscard]] double depth(int link_a, int link_b, std::span<const Pose> X_WL) const;  // 0: apart
  // Every pair that touches.
  [[nodiscard]] std::vector<LinkContact> contacts(std::span<const Pose> X_WL) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
