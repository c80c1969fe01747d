#include "doppel/validation/statics/detail/visual_overlap.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <variant>

#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/reach/arm_reach.h"

namespace doppel {
namespace {

constexpr double kByDesign = 0.95;       // of the samples
constexpr std::size_t kMinSamples = 20;  // samples after which a share says something

bool is_same(const Origin& a, const Origin& b) {
  return a.xyz == b.xyz && a.rpy == b.rpy;
}

bool is_same(const Geometry& a, const Geometry& b) {
  if (a.index() != b.index()) return false;
  if (const auto* const box = std::get_if<Box>(&a)) return box->size == std::get<Box>(b).size;
  if (const auto* const sphere = std::get_if<Sphere>(&a)) return sphere->radius == std::get<Sphere>(b).radius;
  if (const auto* const tube = std::get_if<Cylinder>(&a)) {
    const auto& other = std::get<Cylinder>(b);
    return tube->radius == other.radius && tube->length == other.length;
  }
  if (const auto* const mesh = std::get_if<MeshGeometry>(&a)) {
    const auto& other = std::get<MeshGeometry>(b);
    return mesh->path == other.path && mesh->scale == other.scale && mesh->submesh == other.submesh &&
           mesh->center_submesh == other.center_submesh;
  }
  return false;  // rare shapes are compared by what they touch
}

// Each visual shape is a collision shape, too.
bool is_covered(const Link& link) {
  return std::ranges::all_of(link.visuals, [&](const Visual& visual) {
    return std::ranges::any_of(link.collisions, [&](const Collision& collision) {
      return is_same(visual.origin, collision.origin) && is_same(visual.geometry, collision.geometry);
    });
  });
}

// The robot with its visual shapes as collision shapes. Planes and terrains have no inside.
RobotDescription visual_robot(const RobotDescription& robot) {
  RobotDescription out = robot;
  for (Link& link : out.links) {
    link.collisions.clear();
    for (const Visual& visual : link.visuals) {
      if (std::holds_alternative<Plane>(visual.geometry) ||
          std::holds_alternative<Heightmap>(visual.geometry))
        continue;
      Collision shape;
      shape.name = visual.name;
      shape.origin = visual.origin;
      shape.geometry = visual.geometry;
      shape.source = visual.source;
      link.collisions.push_back(std::move(shape));
    }
  }
  return out;
}

using LinkPair = std::pair<int, int>;

std::set<LinkPair> allowed_links_of(const CollisionScene& scene) {
  std::set<LinkPair> out;
  for (const AllowedPair& pair : scene.allowed_pairs()) out.insert({pair.a.link, pair.b.link});
  return out;
}

// One thread's view of both kinds of shapes.
class ShapePairs {
 public:
  ShapePairs(const Model& model, std::shared_ptr<const CollisionScene> visuals,
             const CollisionScene& collisions)
      : model_(model), visuals_(std::move(visuals)), collisions_(collisions.allowing({})), data_(model) {}

  void place(const Eigen::VectorXd& q) {
    forward_kinematics(model_, data_, q);
    visuals_.set_link_poses(0, data_.X_WL);
    collisions_.set_link_poses(0, data_.X_WL);
  }
  [[nodiscard]] bool visuals_touch(const LinkPair& pair) {
    return visuals_.closer({0, pair.first}, {0, pair.second}, -kTouching);
  }
  // Hulls decide, because a small part that is completely inside of a mesh crosses none of its triangles.
  [[nodiscard]] bool collisions_touch(const LinkPair& pair) {
    return collisions_.distance({0, pair.first}, {0, pair.second}, kTouching).distance < -kTouching;
  }
  // Moved by kVisualOverlap in no direction the second link comes free of the first one.
  [[nodiscard]] bool overlap_deeply(const LinkPair& pair) {
    const PairDistance hulls = visuals_.distance({0, pair.first}, {0, pair.second});
    if (-hulls.distance <= kVisualOverlap) return false;
    std::vector<Eigen::Vector3d> directions{hulls.normal_W};
    for (const double x : {-1.0, 0.0, 1.0}) {
      for (const double y : {-1.0, 0.0, 1.0}) {
        for (const double z : {-1.0, 0.0, 1.0}) {
          if (x != 0 || y != 0 || z != 0) directions.push_back(Eigen::Vector3d(x, y, z).normalized());
        }
      }
    }
    const Pose X_WL = data_.X_WL[static_cast<std::size_t>(pair.second)];
    Pose& moved = data_.X_WL[static_cast<std::size_t>(pair.second)];
    bool out = true;
    for (std::size_t i = 0; i < directions.size() && out; ++i) {
      moved.translation() = X_WL.translation() + kVisualOverlap * directions[i];
      visuals_.set_link_poses(0, data_.X_WL);
      out = visuals_touch(pair);
    }
    moved = X_WL;
    visuals_.set_link_poses(0, data_.X_WL);
    return out;
  }

 private:
  const Model& model_;
  CollisionContext visuals_, collisions_;
  Data data_;
};

// The pairs that may overlap: those that can move against each other, with a visual shape that is no
// collision shape.
std::vector<LinkPair> compared_pairs(const Subject& subject, const CollisionScene& visuals,
                                     const CollisionScene& collisions) {
  const std::set<LinkPair> allowed = allowed_links_of(collisions);
  const auto is_same_shape = [&](int link) {
    const Link* const source =
        subject.description().find_link(subject.model->links[static_cast<std::size_t>(link)].name);
    return source == nullptr || is_covered(*source);
  };
  std::vector<LinkPair> out;
  const auto add = [&](int a, int b) {
    if (!allowed.contains({a, b}) && !(is_same_shape(a) && is_same_shape(b))) out.emplace_back(a, b);
  };
  for (const auto& [a, b] : visuals.tested_pairs()) add(a.link, b.link);
  // A machine whose zero is its start may overlap there, and nowhere else.
  for (const AllowedPair& pair : visuals.allowed_pairs())
    if (pair.reason == kTouchAtStart) add(pair.a.link, pair.b.link);
  return out;
}

}  // namespace

std::vector<VisualOverlap> find_visual_overlaps(const CheckContext& context, const CollisionScene& collisions,
                                                const std::vector<NamedConfiguration>& named,
                                                const std::vector<Eigen::VectorXd>& samples,
                                                std::vector<std::string>& notes) {
  const Subject& subject = context.subject;
  if (std::ranges::all_of(subject.description().links, is_covered)) return {};
  const RobotDescription robot = visual_robot(subject.description());
  Diagnostics found;
  const auto visuals = reach_scene(robot, subject.model, nullptr, {}, found);
  if (!found.all().empty()) {
    notes.push_back("visual shapes are not compared with collision shapes: their triangles cannot be read");
    return {};
  }
  const std::vector<LinkPair> pairs = compared_pairs(subject, *visuals, collisions);
  ShapePairs shapes(*subject.model, visuals, collisions);
  struct Seen {
    std::size_t looked_at = 0, touching = 0;  // samples
    VisualOverlap overlap;
  };
  std::vector<Seen> seen(pairs.size());
  const auto most = static_cast<std::size_t>(kMaxUnseen * static_cast<double>(samples.size()));
  const auto look = [&](const std::string& name, const Eigen::VectorXd& q) {
    shapes.place(q);
    context.report(0);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      auto& [looked_at, touching, overlap] = seen[i];
      if (overlap.is_frequent) continue;
      looked_at += name.empty() ? 1 : 0;
      if (!shapes.visuals_touch(pairs[i])) continue;
      touching += name.empty() ? 1 : 0;
      if (shapes.collisions_touch(pairs[i]) || !shapes.overlap_deeply(pairs[i])) continue;
      if (overlap.q.size() == 0) overlap = {pairs[i], name, q};
      overlap.samples += name.empty() ? 1 : 0;
      overlap.is_frequent = looked_at >= kMinSamples && overlap.samples > most;
    }
  };
  for (const NamedConfiguration& one : named) look(one.name, one.q);
  for (const Eigen::VectorXd& q : samples) look("", q);
  std::vector<VisualOverlap> out;
  for (Seen& one : seen) {
    const bool is_design = one.looked_at > 0 && static_cast<double>(one.touching) >=
                                                    kByDesign * static_cast<double>(one.looked_at);
    if (one.overlap.q.size() > 0 && !is_design) out.push_back(std::move(one.overlap));
  }
  return out;
}

}  // namespace doppel
