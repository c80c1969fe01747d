#include "doppel/physics/engines/bullet/contact_finder.h"

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>

namespace doppel {
namespace {

// Contact threshold: 2 % of a shape's size, as in Bullet, but at least 0.1 mm, below which rounding decides.
constexpr double kNear = 0.02, kNearest = 1e-4;
constexpr int kTilts = 4;  // orientations in which a pair without flat faces is searched for further points

// Bullet's own configuration is made for worlds of thousands of pairs and takes 5 MB per state. Here it has
// to provide one algorithm for each two kinds of shapes, and at most one manifold each.
btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo out;
  out.m_defaultMaxPersistentManifoldPoolSize = 16;
  out.m_defaultMaxCollisionAlgorithmPoolSize = 16;
  return out;
}

}  // namespace

ContactFinder::ContactFinder(const std::vector<Piece>& pieces, const std::vector<PiecePair>& pairs,
                             std::vector<btCollisionObject*> colliders, btCollisionObject& ground,
                             const WorldSettings& settings)
    : pieces_(pieces),
      pairs_(pairs),
      colliders_(std::move(colliders)),
      ground_(ground),
      ground_friction_(uniform_friction(settings.ground_friction)),
      ground_restitution_(settings.ground_restitution),
      friction_rule_(settings.friction_rule),
      configuration_(small_pools()),
      dispatcher_(&configuration_),
      transforms_(pieces.size()),
      low_(pieces.size()),
      high_(pieces.size()) {
  configuration_.setConvexConvexMultipointIterations(kTilts, kTilts);
  dispatcher_.setDispatcherFlags(0);  // thresholds are those of the pieces, not of their substitutes
  for (const Piece& piece : pieces)
    thresholds_.push_back(std::max(kNearest, piece.shape->getContactBreakingThreshold(kNear)));
  points_.reserve(kMaxHullVertices);
}

ContactFinder::~ContactFinder() {
  for (const Known& known : algorithms_) {
    known.algorithm->~btCollisionAlgorithm();
    dispatcher_.freeCollisionAlgorithm(known.algorithm);
  }
}

// Bullet's friction has no direction: the smaller coefficient holds in every one.
double ContactFinder::combined(const Friction& a, const Friction& b) const {
  const PairFriction pair = combine(a, b, friction_rule_);
  return std::min(pair.along, pair.across);
}

void ContactFinder::write_surface(btPersistentManifold& manifold, double friction,
                                  const std::optional<double>& restitution) const {
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    btManifoldPoint& point = manifold.getContactPoint(i);
    point.m_combinedFriction = friction;
    point.m_combinedRestitution = restitution.value_or(0.0);
    if (restitution) point.m_contactPointFlags |= kHasRestitution;
  }
}

void ContactFinder::find(std::span<const Pose> poses) {
  found_.clear();
  touching_.clear();
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    transforms_[i] = to_bullet(poses[i]);
    pieces_[i].shape->getAabb(transforms_[i], low_[i], high_[i]);
  }
  for (const PiecePair& pair : pairs_) {
    const auto a = static_cast<std::size_t>(pair.first);
    if (pair.second < 0) {
      if (low_[a].z() < thresholds_[a]) touch_ground(pair, poses[a]);
      continue;
    }
    const auto b = static_cast<std::size_t>(pair.second);
    const double near = std::min(thresholds_[a], thresholds_[b]);
    bool apart = false;
    for (int i = 0; i < 3; ++i)
      apart = apart || low_[a][i] > high_[b][i] + near || low_[b][i] > high_[a][i] + near;
    if (!apart) touch(pair);
  }
}

btPersistentManifold& ContactFinder::next_manifold() {
  if (found_.size() == pool_.size()) {
    pool_.push_back(std::make_unique<btPersistentManifold>());
    found_.reserve(pool_.size());
    touching_.reserve(pool_.size());
  }
  return *pool_[found_.size()];
}

void ContactFinder::touch_ground(const PiecePair& pair, const Pose& X_WS) {
  const auto a = static_cast<std::size_t>(pair.first);
  btPersistentManifold& manifold = next_manifold();
  manifold.setBodies(colliders_[a], &ground_);
  manifold.clearManifold();
  manifold.setContactBreakingThreshold(thresholds_[a]);
  manifold.setContactProcessingThreshold(SIMD_INFINITY);
  const btCollisionObjectWrapper wrap_a(nullptr, pieces_[a].shape.get(), colliders_[a], transforms_[a], -1,
                                        -1);
  const btCollisionObjectWrapper wrap_b(nullptr, ground_.getCollisionShape(), &ground_,
                                        ground_.getWorldTransform(), -1, -1);
  btManifoldResult result(&wrap_a, &wrap_b);
  result.setPersistentManifold(&manifold);
  lowest_points(pieces_[a], -X_WS.linear().transpose().col(2), points_);
  for (const Eigen::Vector3d& point : points_) {
    const Eigen::Vector3d p_W = X_WS * point;
    if (p_W.z() < thresholds_[a]) result.addContactPoint({0, 0, 1}, {p_W.x(), p_W.y(), 0.0}, p_W.z());
  }
  if (manifold.getNumContacts() == 0) return;
  write_surface(manifold, combined(pieces_[a].friction, ground_friction_),
                combine(pieces_[a].source.restitution, ground_restitution_));
  found_.push_back(&manifold);
  touching_.push_back(&pair);
}

// The only state of a Bullet algorithm is a manifold: the one that it is made with, or its own.
const ContactFinder::Known& ContactFinder::algorithm_for(const Piece& a, const Piece& b) {
  const int type_a = a.shape->getShapeType(), type_b = b.shape->getShapeType();
  for (const Known& known : algorithms_) {
    if (known.type_a == type_a && known.type_b == type_b) return known;
  }
  const btCollisionObject any_a, any_b;
  const btTransform anywhere = btTransform::getIdentity();
  const btCollisionObjectWrapper wrap_a(nullptr, a.shape.get(), &any_a, anywhere, -1, -1);
  const btCollisionObjectWrapper wrap_b(nullptr, b.shape.get(), &any_b, anywhere, -1, -1);
  btCollisionAlgorithm* const made =
      dispatcher_.findAlgorithm(&wrap_a, &wrap_b, &work_, BT_CONTACT_POINT_ALGORITHMS);
  btManifoldArray own;
  made->getAllContactManifolds(own);
  algorithms_.push_back({type_a, type_b, made, own.size() > 0 ? own[0] : &work_});
  return algorithms_.back();
}

void ContactFinder::touch(const PiecePair& pair) {
  const auto a = static_cast<std::size_t>(pair.first), b = static_cast<std::size_t>(pair.second);
  const Known& known = algorithm_for(pieces_[a], pieces_[b]);
  known.manifold->setBodies(colliders_[a], colliders_[b]);
  known.manifold->clearManifold();
  known.manifold->setContactBreakingThreshold(std::min(thresholds_[a], thresholds_[b]));
  const btCollisionObjectWrapper wrap_a(nullptr, pieces_[a].shape.get(), colliders_[a], transforms_[a], -1,
                                        -1);
  const btCollisionObjectWrapper wrap_b(nullptr, pieces_[b].shape.get(), colliders_[b], transforms_[b], -1,
                                        -1);
  btManifoldResult result(&wrap_a, &wrap_b);
  const btDispatcherInfo info;
  known.algorithm->processCollision(&wrap_a, &wrap_b, info, &result);
  if (known.manifold->getNumContacts() == 0) return;
  btPersistentManifold& manifold = next_manifold();
  manifold = *known.manifold;
  manifold.setContactProcessingThreshold(SIMD_INFINITY);
  write_surface(manifold, combined(pieces_[a].friction, pieces_[b].friction),
                combine(pieces_[a].source.restitution, pieces_[b].source.restitution));
  found_.push_back(&manifold);
  touching_.push_back(&pair);
}

}  // namespace doppel
