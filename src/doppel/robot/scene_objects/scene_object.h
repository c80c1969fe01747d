#pragma once
// An object around a robot that no physics moves, as MoveIt's planning scene has them: it stands in the
// world, or is attached to a link and moves with it.

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "doppel/description/meshes/mesh.h"
#include "doppel/export.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel {

// The points p with normal . p + offset = 0, without a border and without a solid: both sides are free.
struct ScenePlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of any length but 0
  double offset = 0;                                  // m times the length of the normal
};
using SharedTriangles = std::shared_ptr<const TriangleMesh>;  // closed or open
// Boxes that fill what an octomap calls occupied.
using SharedCells = std::shared_ptr<const std::vector<Eigen::AlignedBox3d>>;

struct ObjectShape {
  std::variant<Box, Sphere, Cylinder, Cone, ScenePlane, SharedTriangles, SharedCells> geometry;
  Pose X_OS = Pose::Identity();
};

struct Subframe {
  std::string name;  // the frame is "object/name"
  Pose X_OF = Pose::Identity();
};

struct SceneObject {
  std::string id;
  Pose X_PO = Pose::Identity();  // P: the world, or the link that it is attached to
  std::vector<ObjectShape> shapes = {};
  std::vector<Subframe> subframes = {};
  std::optional<Eigen::Vector4f> rgba = {};  // 0..1
  // The link of the robot that it is attached to; empty: none. It may touch this link, what is rigidly joined
  // to it, and `touch_links`.
  std::string link = {};
  std::vector<std::string> touch_links = {};
};

// Throws InputError, rule "scene.shape": a size that is not positive or beyond size_limits.h, a number that
// is not finite, a mesh without triangles or with a corner that it does not have; "scene.object": no id, no
// shape, a subframe without a name. `where`: of the object in the user's source.
DOPPEL_API void check_object(const SceneObject& object, const SourceLocation& where = {});

// The object in a collision scene, with its root in the frame of X_WO; the caller says what holds it. Planes
// are plates of 200 m and 1 mm.
[[nodiscard]] DOPPEL_API SceneInstance scene_instance(const SceneObject& object, const Pose& X_WO);

}  // namespace doppel
