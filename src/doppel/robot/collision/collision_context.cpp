#include <algorithm>
#include <optional>
#include <stdexcept>

#include "doppel/robot/collision/detail/field_distance.h"
#include "doppel/robot/collision/detail/scene_bodies.h"
#include "doppel/robot/collision/detail/surface.h"

namespace doppel {

// Not in an anonymous namespace, because CollisionContext::Impl, which contains it, has external linkage.
struct NearPair {
  double bound = 0;  // m: the pair is not nearer
  int index = 0;     // of CollisionScene::Impl::tested_bodies
};

struct CollisionContext::Impl {
  explicit Impl(std::shared_ptr<const CollisionScene> the_scene);

  void set_root(int instance, const Pose& X_WR);
  void place(int instance);
  void place_body(const CollidingBody& body, const Pose& X_WL);
  [[nodiscard]] double bound(const CollidingBody& a, const CollidingBody& b) const;
  void measure(const CollidingBody& a, const CollidingBody& b, PairDistance& nearest);
  [[nodiscard]] bool closer(const CollidingBody& a, const CollidingBody& b, double clearance);
  [[nodiscard]] bool shapes_closer(const CollidingBody& a, std::size_t i, const CollidingBody& b,
                                   std::size_t k, double clearance);
  [[nodiscard]] bool hulls_apart(const CollidingBody& a, std::size_t i, const CollidingBody& b,
                                 std::size_t k) const;
  [[nodiscard]] bool surfaces_cross(const CollidingBody& a, std::size_t i, const CollidingBody& b,
                                    std::size_t k) const;
  [[nodiscard]] ConvexDistance shape_distance(const CollidingBody& a, std::size_t i, const CollidingBody& b,
                                              std::size_t k, double far);
  [[nodiscard]] ConvexDistance ground_distance(const CollidingBody& b, std::size_t k) const;

  [[nodiscard]] const CollidingBody& body(int index) const {
    return parts.bodies[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] std::size_t shape_index(const CollidingBody& owner, std::size_t shape) const {
    return owner.first_shape + shape;
  }
  [[nodiscard]] const Pose& pose(const CollidingBody& owner, std::size_t shape) const {
    return X_WS[shape_index(owner, shape)];
  }
  [[nodiscard]] double shape_bound(const CollidingBody& a, std::size_t i, const CollidingBody& b,
                                   std::size_t k) const;

  std::shared_ptr<const CollisionScene> scene;
  const CollisionScene::Impl& parts;
  std::vector<std::optional<Data>> data;    // [instances]
  std::vector<Pose> X_WR;                   // [instances]
  std::vector<std::vector<Pose>> X_WL;      // [instances][links]
  std::vector<Eigen::Vector3d> p_WC;        // [bodies] centre of the bounding sphere
  std::vector<Pose> X_WS;                   // [shapes]
  std::vector<Eigen::Vector3d> shape_p_WC;  // [shapes]
  std::vector<NearPair> candidates;
  std::vector<PairDistance> contacts;
  ConvexWorkspace memory;
  FieldWorkspace cells;
  bool only_surfaces = false;  // of meshes: their hulls do not count, whatever the clearance
};

CollisionContext::Impl::Impl(std::shared_ptr<const CollisionScene> the_scene)
    : scene(std::move(the_scene)), parts(scene->impl()) {
  p_WC.resize(parts.bodies.size(), Eigen::Vector3d::Zero());
  X_WS.resize(parts.shapes, Pose::Identity());
  shape_p_WC.resize(X_WS.size(), Eigen::Vector3d::Zero());
  candidates.reserve(parts.tested.size());
  contacts.reserve(parts.tested.size());
  for (const SceneInstance& instance : parts.instances) {
    data.emplace_back();
    X_WR.push_back(instance.X_WR);
    X_WL.emplace_back(instance.shapes.size(), Pose::Identity());
    if (instance.model == nullptr) continue;
    data.back().emplace(*instance.model);
    forward_kinematics(*instance.model, *data.back(), instance.model->neutral());
  }
  for (int i = 0; i < static_cast<int>(parts.instances.size()); ++i) {
    if (!parts.instances[static_cast<std::size_t>(i)].held) set_root(i, X_WR[static_cast<std::size_t>(i)]);
  }
}

void CollisionContext::Impl::set_root(int instance, const Pose& X_WR_new) {
  const auto i = static_cast<std::size_t>(instance);
  X_WR.at(i) = X_WR_new;
  for (std::size_t link = 0; link < X_WL[i].size(); ++link)
    X_WL[i][link] = data[i] ? Pose(X_WR[i] * data[i]->X_WL[link]) : X_WR[i];
  place(instance);
}

// The bodies of an instance at the poses of its links, and what they hold.
void CollisionContext::Impl::place(int instance) {
  const auto i = static_cast<std::size_t>(instance);
  for (std::size_t link = 0; link < X_WL[i].size(); ++link) {
    const int index = parts.body_of[i][link];
    if (index >= 0) place_body(body(index), X_WL[i][link]);
  }
  // An instance comes behind the one that holds it, so that one pass in this order places chains of held
  // objects.
  for (std::size_t k = i + 1; k < parts.instances.size(); ++k) {
    const std::optional<HeldBy>& held = parts.instances[k].held;
    if (held && held->holder.instance == instance)
      set_root(static_cast<int>(k), X_WL[i][static_cast<std::size_t>(held->holder.link)] * held->X_LO);
  }
}

void CollisionContext::Impl::place_body(const CollidingBody& placed, const Pose& pose_of_link) {
  p_WC[placed.index] = pose_of_link * placed.centre;
  for (std::size_t i = 0; i < placed.shapes.size(); ++i) {
    Pose& X = X_WS[shape_index(placed, i)];
    X = pose_of_link * placed.shapes[i].X_LS;
    shape_p_WC[shape_index(placed, i)] = X * placed.shapes[i].solid.centre;
  }
}

// The distance of the bounding spheres, or of the second one from the ground.
double CollisionContext::Impl::bound(const CollidingBody& a, const CollidingBody& b) const {
  const Eigen::Vector3d& centre = p_WC[b.index];
  if (a.id.is_ground()) return centre.z() - b.radius;
  return (centre - p_WC[a.index]).norm() - a.radius - b.radius;
}

double CollisionContext::Impl::shape_bound(const CollidingBody& a, std::size_t i, const CollidingBody& b,
                                           std::size_t k) const {
  return (shape_p_WC[shape_index(b, k)] - shape_p_WC[shape_index(a, i)]).norm() - a.shapes[i].solid.radius -
         b.shapes[k].solid.radius;
}

ConvexDistance CollisionContext::Impl::ground_distance(const CollidingBody& b, std::size_t k) const {
  const SolidShape& shape = b.shapes[k];
  const Pose& X = pose(b, k);
  ConvexDistance out;
  // The lowest point of the shape: its support in the direction -z of the world, which in the shape's frame
  // is the third row of the rotation, negated.
  out.p_B = X * shape.solid.support(-X.linear().row(2).transpose());
  out.p_B.z() -= shape.solid.rounding;
  out.distance = out.p_B.z();
  out.p_A << out.p_B.x(), out.p_B.y(), 0;
  return out;
}

// In the frame of the shape of a.
ConvexDistance CollisionContext::Impl::shape_distance(const CollidingBody& a, std::size_t i,
                                                      const CollidingBody& b, std::size_t k, double far) {
  const SolidShape &first = a.shapes[i], &second = b.shapes[k];
  const Pose X_AB = pose(a, i).inverse(Eigen::Isometry) * pose(b, k);
  if (first.field != nullptr) return field_distance(*first.field, second.solid, X_AB, far, cells, memory);
  // A field is always the first argument of field_distance(), so that the result is mirrored where the
  // second shape has it: points change their frame and roles, and the normal its direction.
  if (second.field == nullptr) return convex_distance(first.solid, second.solid, X_AB, far, memory);
  const ConvexDistance found = field_distance(*second.field, first.solid, X_AB.inverse(), far, cells, memory);
  ConvexDistance out;
  out.distance = found.distance;
  out.p_A = X_AB * found.p_B;
  out.p_B = X_AB * found.p_A;
  out.normal_A = -(X_AB.linear() * found.normal_A);
  return out;
}

// Replaces `nearest` if two shapes of the bodies are nearer.
void CollisionContext::Impl::measure(const CollidingBody& a, const CollidingBody& b, PairDistance& nearest) {
  const bool ground = a.id.is_ground();
  for (std::size_t i = 0; i < (ground ? 1 : a.shapes.size()); ++i) {
    for (std::size_t k = 0; k < b.shapes.size(); ++k) {
      if (!ground && shape_bound(a, i, b, k) >= nearest.distance) continue;
      const ConvexDistance found =
          ground ? ground_distance(b, k) : shape_distance(a, i, b, k, nearest.distance);
      if (!(found.distance < nearest.distance)) continue;
      const Pose X_WA = ground ? Pose::Identity() : pose(a, i);
      nearest = {a.id,
                 b.id,
                 ground ? ShapeId{} : a.shapes[i].id,
                 b.shapes[k].id,
                 found.distance,
                 X_WA * found.p_A,
                 X_WA * found.p_B,
                 X_WA.linear() * found.normal_A};
    }
  }
}

// True if a plane is found that separates the shapes, with all vertices of their meshes: faster than their
// trees of triangles, most of which it spares.
bool CollisionContext::Impl::hulls_apart(const CollidingBody& a, std::size_t i, const CollidingBody& b,
                                         std::size_t k) const {
  const SolidShape &first = a.shapes[i], &second = b.shapes[k];
  if (first.field != nullptr || second.field != nullptr) return false;
  const Pose X_AB = pose(a, i).inverse(Eigen::Isometry) * pose(b, k);
  const auto direction = separating_direction(first.solid, second.solid, X_AB);
  if (!direction) return false;
  const Eigen::Vector3d back_B = -(X_AB.linear().transpose() * *direction);
  return direction->dot(X_AB.translation()) - second.extent(back_B) > first.extent(*direction);
}

bool CollisionContext::Impl::surfaces_cross(const CollidingBody& a, std::size_t i, const CollidingBody& b,
                                            std::size_t k) const {
  const SolidShape &first = a.shapes[i], &second = b.shapes[k];
  return surface_functions().touch(first.surface.get(), pose(a, i) * first.X_SG, second.surface.get(),
                                   pose(b, k) * second.X_SG);
}

bool CollisionContext::Impl::shapes_closer(const CollidingBody& a, std::size_t i, const CollidingBody& b,
                                           std::size_t k, double clearance) {
  const SolidShape &first = a.shapes[i], &second = b.shapes[k];
  if (shape_bound(a, i, b, k) >= std::max(clearance, 0.0)) return false;
  // Convex hulls of meshes are reduced, and a mesh may be hollow: triangles that cross are found by the
  // surfaces themselves.
  if (first.surface != nullptr && second.surface != nullptr && (first.is_mesh || second.is_mesh)) {
    if (!hulls_apart(a, i, b, k) && surfaces_cross(a, i, b, k)) return true;
    if (only_surfaces || clearance <= 0) return false;
  }
  if (first.field != nullptr || second.field != nullptr)
    return shape_distance(a, i, b, k, clearance).distance < clearance;
  return convex_closer(first.solid, second.solid, pose(a, i).inverse(Eigen::Isometry) * pose(b, k), clearance,
                       memory);
}

bool CollisionContext::Impl::closer(const CollidingBody& a, const CollidingBody& b, double clearance) {
  if (bound(a, b) >= std::max(clearance, 0.0)) return false;
  for (std::size_t k = 0; k < b.shapes.size(); ++k) {
    if (a.id.is_ground() && ground_distance(b, k).distance < clearance) return true;
    for (std::size_t i = 0; i < a.shapes.size(); ++i) {
      if (shapes_closer(a, i, b, k, clearance)) return true;
    }
  }
  return false;
}

CollisionContext::CollisionContext(std::shared_ptr<const CollisionScene> scene)
    : impl_(std::make_unique<Impl>(std::move(scene))) {}

CollisionContext::~CollisionContext() = default;
CollisionContext::CollisionContext(CollisionContext&&) noexcept = default;

const CollisionScene& CollisionContext::scene() const {
  return *impl_->scene;
}

void CollisionContext::set_root(int instance, const Pose& X_WR) {
  impl_->set_root(instance, X_WR);
}

void CollisionContext::set_configuration(int instance, const ConstVector& q) {
  const auto i = static_cast<std::size_t>(instance);
  const auto& model = impl_->parts.instances.at(i).model;
  if (model == nullptr || q.size() != model->nq)
    throw std::out_of_range("the instance has no model, or one of another number of positions");
  forward_kinematics(*model, *impl_->data[i], q);
  impl_->set_root(instance, impl_->X_WR[i]);
}

void CollisionContext::set_link_poses(int instance, std::span<const Pose> X_WL) {
  std::vector<Pose>& poses = impl_->X_WL.at(static_cast<std::size_t>(instance));
  if (X_WL.size() != poses.size()) throw std::out_of_range("the instance has another number of links");
  std::ranges::copy(X_WL, poses.begin());
  impl_->place(instance);
}

PairDistance CollisionContext::distance(double far) {
  Impl& m = *impl_;
  m.candidates.clear();
  for (std::size_t i = 0; i < m.parts.tested_bodies.size(); ++i) {
    const auto& [a, b] = m.parts.tested_bodies[i];
    if (const double bound = m.bound(m.body(a), m.body(b)); bound < far)
      m.candidates.push_back({bound, static_cast<int>(i)});
  }
  // The nearest spheres first: what they hold is likely to be nearer than the spheres of the others.
  std::ranges::sort(m.candidates, {}, [](const NearPair& pair) { return std::pair(pair.bound, pair.index); });
  PairDistance nearest;
  nearest.distance = far;
  for (const NearPair& pair : m.candidates) {
    // The bounds are sorted, so that no later pair can be nearer.
    if (pair.bound >= nearest.distance) break;
    const auto& [a, b] = m.parts.tested_bodies[static_cast<std::size_t>(pair.index)];
    m.measure(m.body(a), m.body(b), nearest);
  }
  if (nearest.distance == far) nearest.distance = kFarAway;
  return nearest;
}

PairDistance CollisionContext::distance(BodyId a, BodyId b, double far) {
  const auto [first, second] = std::minmax(a, b);
  const int i = impl_->parts.find(first), k = impl_->parts.find(second);
  PairDistance nearest;
  nearest.distance = far;
  if (i >= 0 && k >= 0) impl_->measure(impl_->body(i), impl_->body(k), nearest);
  if (nearest.distance == far) nearest.distance = kFarAway;
  return nearest;
}

bool CollisionContext::closer(BodyId a, BodyId b, double clearance) {
  const auto [first, second] = std::minmax(a, b);
  const int i = impl_->parts.find(first), k = impl_->parts.find(second);
  return i >= 0 && k >= 0 && impl_->closer(impl_->body(i), impl_->body(k), clearance);
}

bool CollisionContext::surfaces_touch(BodyId a, BodyId b) {
  const auto [first, second] = std::minmax(a, b);
  const int i = impl_->parts.find(first), k = impl_->parts.find(second);
  if (i < 0 || k < 0) return false;
  impl_->only_surfaces = true;
  const bool out = impl_->closer(impl_->body(i), impl_->body(k), kTouching);
  impl_->only_surfaces = false;
  return out;
}

bool CollisionContext::in_collision(double clearance) {
  return std::ranges::any_of(impl_->parts.tested_bodies, [&](const auto& pair) {
    return impl_->closer(impl_->body(pair.first), impl_->body(pair.second), clearance);
  });
}

bool CollisionContext::tested_closer(std::size_t pair, double clearance) {
  const auto& [a, b] = impl_->parts.tested_bodies.at(pair);
  return impl_->closer(impl_->body(a), impl_->body(b), clearance);
}

std::span<const PairDistance> CollisionContext::contacts(double clearance) {
  Impl& m = *impl_;
  m.contacts.clear();
  for (const auto& [a, b] : m.parts.tested_bodies) {
    if (!m.closer(m.body(a), m.body(b), clearance)) continue;
    PairDistance nearest;
    m.measure(m.body(a), m.body(b), nearest);
    nearest.distance = std::min(nearest.distance, clearance);  // surfaces cross where reduced hulls do not
    m.contacts.push_back(nearest);
  }
  return m.contacts;
}

}  // namespace doppel
