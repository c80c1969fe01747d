#pragma once
// Contacts between shapes, computed from their poses alone: nothing is kept from one step to the next, so
// that the result does not depend on how a state was reached.

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "doppel/physics/contract/detail/contact_rule.h"
#include "doppel/physics/engines/bullet/collision_pieces.h"

namespace doppel {

// Two pieces that may touch; second -1: the ground.
struct PiecePair {
  int first = -1, second = -1;
};

// The flag of a contact point whose restitution was written; Bullet's own flags are below.
inline constexpr int kHasRestitution = 1 << 20;

class ContactFinder {
 public:
  // `pieces` and `pairs` outlive this. colliders: of each piece; ground: the collision object of the plane
  // z = 0.
  ContactFinder(const std::vector<Piece>& pieces, const std::vector<PiecePair>& pairs,
                std::vector<btCollisionObject*> colliders, btCollisionObject& ground,
                const WorldSettings& settings);
  ~ContactFinder();
  ContactFinder(const ContactFinder&) = delete;
  ContactFinder& operator=(const ContactFinder&) = delete;

  // poses: X_WS of each piece. Allocates only if more pairs touch than ever before.
  void find(std::span<const Pose> poses);
  // Manifolds of the pairs that touch or nearly touch, in the order of `pairs`.
  [[nodiscard]] std::vector<btPersistentManifold*>& manifolds() { return found_; }
  [[nodiscard]] const PiecePair& pair_of(std::size_t manifold) const { return *touching_[manifold]; }

 private:
  btPersistentManifold& next_manifold();
  void touch_ground(const PiecePair& pair, const Pose& X_WS);
  void touch(const PiecePair& pair);
  [[nodiscard]] double combined(const Friction& a, const Friction& b) const;
  void write_surface(btPersistentManifold& manifold, double friction,
                     const std::optional<double>& restitution) const;
  struct Known {
    int type_a, type_b;
    btCollisionAlgorithm* algorithm;
    btPersistentManifold* manifold;  // output of the algorithm
  };
  [[nodiscard]] const Known& algorithm_for(const Piece& a, const Piece& b);

  const std::vector<Piece>& pieces_;
  const std::vector<PiecePair>& pairs_;
  std::vector<btCollisionObject*> colliders_;
  btCollisionObject& ground_;
  Friction ground_friction_;
  std::optional<double> ground_restitution_;
  FrictionRule friction_rule_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btPersistentManifold work_;  // for algorithms without a manifold of their own
  std::vector<Known> algorithms_;
  std::vector<btTransform> transforms_;
  std::vector<btVector3> low_, high_;  // boxes around the pieces
  std::vector<double> thresholds_;     // m: distance below which a piece counts as touching
  std::vector<std::unique_ptr<btPersistentManifold>> pool_;
  std::vector<btPersistentManifold*> found_;
  std::vector<const PiecePair*> touching_;
  std::vector<Eigen::Vector3d> points_;
};

}  // namespace doppel
