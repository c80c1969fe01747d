#pragma once
// Contacts between links of a robot and their depth, by the <collision> elements: primitives as written,
// meshes as their convex hulls or, on request, as triangles. Used for checks of a description and for
// self-collision matrices; the simulation uses the engine's own detection. Hulls and primitives: convex.h;
// triangles: the bounding volume trees of FCL (Pan, Chitta, Manocha 2012).

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "doppel/base/math/pose.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// True if it is a primitive with positive dimensions, or a mesh with a file.
DOPPEL_API bool has_extent(const Geometry& geometry);

enum class CollisionDetail {
  hulls,      // every mesh as its convex hull: fast, solid, as in the simulation
  triangles,  // the meshes' surfaces; a mesh that is completely inside another one does not touch it
};

struct LinkContact {
  int link_a = 0, link_b = 0;  // indices into RobotDescription::links, a < b
  double depth = 0;            // m, along the shortest separating translation; of hulls
};

class DOPPEL_API LinkCollider {
 public:
  // Meshes without a readable file and primitives without a size are left out. Throws std::runtime_error if
  // the module for triangles cannot be loaded.
  LinkCollider(const RobotDescription& robot, CollisionDetail detail);
  ~LinkCollider();
  LinkCollider(LinkCollider&&) noexcept;

  [[nodiscard]] bool has_shape(int link) const;
  // X_WL: the pose of every link, by index into RobotDescription::links. Hulls that overlap by less than 1e-6
  // m are face to face and do not touch.
  [[nodiscard]] bool touch(int link_a, int link_b, std::span<const Pose> X_WL) const;
  [[nodiscard]] double depth(int link_a, int link_b, std::span<const Pose> X_WL) const;  // m; 0: apart
  // All pairs that touch.
  [[nodiscard]] std::vector<LinkContact> contacts(std::span<const Pose> X_WL) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
