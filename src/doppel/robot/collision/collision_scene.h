#pragma once
// Distances, contacts and collisions between the links of robots, the objects around them and the ground.
//
//   CollisionScene    what can touch what: instances with their shapes, and the pairs that are allowed to
//                     touch, each with its reason. Immutable, shared between threads.
//   CollisionContext  the poses and the memory of one thread.
//
//   auto scene = std::make_shared<const CollisionScene>(std::vector{robot, table}, options);
//   CollisionContext context(scene);
//   context.set_configuration(0, q);
//   if (!context.in_collision()) clearance = context.distance().distance;
//
// Shapes are those of link_shapes.h: primitives as written, meshes as their convex hulls or, on request, as
// triangles. Hulls and primitives: convex.h; triangles: the bounding volume trees of FCL (Pan, Chitta,
// Manocha 2012), a plugin module.

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/collision/body_id.h"
#include "doppel/robot/collision/link_shapes.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {

enum class CollisionDetail {
  hulls,      // every mesh as its convex hull: fast, solid, as in the simulation
  triangles,  // the meshes' surfaces; a mesh that is completely inside another one does not touch it
};

// An object that a link holds: it moves with the link and may touch it, what is rigidly joined to it, and the
// touch links.
struct HeldBy {
  BodyId holder;                      // of an instance before this one
  Pose X_LO = Pose::Identity();       // the object's root in the link
  std::vector<int> touch_links = {};  // of the holder's instance
};

struct SceneInstance {
  std::string name;
  std::shared_ptr<const Model> model;  // nullptr: an object of one body
  LinkShapes shapes;                   // [links]; of an object [1]
  Pose X_WR = Pose::Identity();        // links[0] of the model, or the object, until a context moves it
  bool moves = false;                  // contexts move its root, so that what is fixed to it can collide
  bool self_collision = true;
  std::optional<HeldBy> held = {};
  // The source of the shapes, read by the constructor of a scene with CollisionDetail::triangles.
  const RobotDescription* description = nullptr;
};

// A robot as its description alone gives it, for checks and exports: hulls are those of the cached reports,
// and shapes that cannot be read are left out. `robot`: valid until the scene is made; `model` is compiled
// from it.
[[nodiscard]] DOPPEL_API SceneInstance described_robot(const RobotDescription& robot, const Model& model);

// A pair that is never a collision, and why: "joined by Revolute 2", "both fixed to the world".
struct AllowedPair {
  BodyId a, b;  // a < b
  std::string reason;
};

struct SceneOptions {
  bool ground = false;  // the half space below z = 0
  CollisionDetail detail = CollisionDetail::hulls;
  std::vector<AllowedPair> allowed = {};  // besides those that follow from the structure, in any order
};

class DOPPEL_API CollisionScene {
 public:
  // Throws std::invalid_argument: the shapes of an instance do not fit its model, or it is held by a later
  // one; std::runtime_error: the module for triangles cannot be loaded; InputError: a mesh for it cannot be
  // read.
  explicit CollisionScene(std::vector<SceneInstance> instances, SceneOptions options = {});
  ~CollisionScene();
  CollisionScene(const CollisionScene&) = delete;
  CollisionScene& operator=(const CollisionScene&) = delete;

  // The same instances, with more allowed pairs: it reads no file and shares the surfaces.
  [[nodiscard]] std::shared_ptr<const CollisionScene> allowing(const std::vector<AllowedPair>& pairs) const;

  [[nodiscard]] const std::vector<SceneInstance>& instances() const;
  [[nodiscard]] bool has_shape(BodyId body) const;
  // The pairs of bodies with shapes, in ascending order: those that queries test, and the others.
  [[nodiscard]] const std::vector<std::pair<BodyId, BodyId>>& tested_pairs() const;
  [[nodiscard]] const std::vector<AllowedPair>& allowed_pairs() const;

  struct Impl;
  explicit CollisionScene(Impl impl);
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<const Impl> impl_;
};

inline constexpr double kFarAway = std::numeric_limits<double>::infinity();
inline constexpr double kTouching = 1e-6;  // m: bodies face to face

// The nearest shapes of two bodies.
struct PairDistance {
  BodyId a, b;                 // a < b
  ShapeId shape_a, shape_b;    // of the ground: none
  double distance = kFarAway;  // m; negative: the depth, along the shortest separating translation
  Eigen::Vector3d p_a_W = Eigen::Vector3d::Zero(), p_b_W = Eigen::Vector3d::Zero();  // m, nearest points
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();                               // unit, from a to b
};

// The poses of one thread and its memory, sized once: no other function than the constructor allocates. The
// exception are trees of CollisionDetail::triangles, which are built when a pair first needs them. At first
// every instance is at its X_WR, in Model::neutral().
//
// Indices are preconditions, checked: std::out_of_range.
class DOPPEL_API CollisionContext {
 public:
  explicit CollisionContext(std::shared_ptr<const CollisionScene> scene);
  ~CollisionContext();
  CollisionContext(CollisionContext&&) noexcept;

  [[nodiscard]] const CollisionScene& scene() const;

  // Held objects follow. q [nq] rad, m; X_WL [links] poses in the world, which replace the root's.
  void set_root(int instance, const Pose& X_WR);
  void set_configuration(int instance, const ConstVector& q);
  void set_link_poses(int instance, std::span<const Pose> X_WL);

  // Distances are those of hulls and primitives, also with CollisionDetail::triangles, where the surfaces are
  // not nearer. `far`: beyond it only a lower bound is searched, which is faster.
  //
  // The nearest of all tested pairs; kFarAway: there is none within `far`.
  [[nodiscard]] PairDistance distance(double far = kFarAway);
  // The distance of two bodies, tested or not.
  [[nodiscard]] PairDistance distance(BodyId a, BodyId b, double far = kFarAway);

  // True if two bodies, tested or not, or any tested pair, are closer than `clearance` (m). kTouching counts
  // face to face as a collision, -kTouching does not. With CollisionDetail::triangles, surfaces that cross
  // are closer than any clearance, and others are so only by a positive clearance.
  [[nodiscard]] bool closer(BodyId a, BodyId b, double clearance);
  [[nodiscard]] bool in_collision(double clearance = kTouching);
  // The same of the pair with this index in CollisionScene::tested_pairs().
  [[nodiscard]] bool tested_closer(std::size_t pair, double clearance);
  // The same of two bodies by the surfaces alone where a mesh has them: its hull does not count. Other shapes
  // touch within kTouching.
  [[nodiscard]] bool surfaces_touch(BodyId a, BodyId b);

  // Each tested pair that is closer than `clearance`, by its deepest shapes; valid until the next call.
  [[nodiscard]] std::span<const PairDistance> contacts(double clearance = -kTouching);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
