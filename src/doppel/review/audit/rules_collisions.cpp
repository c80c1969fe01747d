// Links that touch in the pose without commands: at zero, or at the nearest pose inside the limits. Hulls
// first, as the physics engine uses them; a pair whose hulls overlap by more than their shapes allow is
// checked by its triangles.
#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel::audit_rules {
namespace {

constexpr double kDepth = 1e-3;            // m; less is a touch, not an overlap
constexpr double kNeighbourShare = 0.5;    // of the smaller body's least width
constexpr std::size_t kMaxReported = 50;   // pairs
constexpr std::size_t kTriangles = 10000;  // checked in one audit, which has to take milliseconds

// Links that fixed joints make one body, and which bodies share a joint.
class Bodies {
 public:
  explicit Bodies(const RobotDescription& robot) {
    for (std::size_t i = 0; i < robot.links.size(); ++i) {
      body_.push_back(static_cast<int>(i));
      index_.emplace(robot.links[i].name, static_cast<int>(i));
    }
    for (const Joint& joint : robot.joints) {
      if (joint.type != JointType::fixed) continue;
      merge(of(joint.parent), of(joint.child));
    }
    for (const Joint& joint : robot.joints) {
      if (joint.type == JointType::fixed) continue;
      const int a = of(joint.parent), b = of(joint.child);
      if (a < 0 || b < 0) continue;
      neighbours_.insert(std::minmax(a, b));
      chain_.emplace_back(a, b);
      const Joint* leader = joint.mimic ? robot.find_joint(joint.mimic->joint) : nullptr;
      const int led = leader == nullptr ? -1 : of(leader->child);
      if (led >= 0) coupled_.insert(std::minmax(b, led));
    }
    look_through_frames(robot);
  }
  [[nodiscard]] bool same(int link_a, int link_b) const { return at(link_a) == at(link_b); }
  [[nodiscard]] bool neighbours(int link_a, int link_b) const {
    return neighbours_.contains(std::minmax(at(link_a), at(link_b)));
  }
  [[nodiscard]] bool coupled(int link_a, int link_b) const {
    return coupled_.contains(std::minmax(at(link_a), at(link_b)));
  }

 private:
  [[nodiscard]] int at(int link) const { return body_[static_cast<std::size_t>(link)]; }
  [[nodiscard]] int of(const std::string& name) const {
    const auto found = index_.find(name);
    return found == index_.end() ? -1 : at(found->second);
  }
  // A body without a shape, as between the two axes of a steered wheel, does not separate its neighbours.
  void look_through_frames(const RobotDescription& robot) {
    std::set<int> shaped;
    for (std::size_t i = 0; i < robot.links.size(); ++i) {
      if (!robot.links[i].collisions.empty()) shaped.insert(body_[i]);
    }
    for (const int body : std::set<int>(body_.begin(), body_.end())) {
      if (shaped.contains(body)) continue;
      for (const auto& [parent, middle] : chain_) {
        for (const auto& [same, child] : chain_) {
          if (middle == body && same == body) neighbours_.insert(std::minmax(parent, child));
        }
      }
    }
  }
  void merge(int a, int b) {
    if (a < 0 || b < 0) return;
    std::replace(body_.begin(), body_.end(), b, a);
  }
  std::vector<int> body_;
  std::map<std::string, int> index_;
  std::set<std::pair<int, int>> neighbours_, coupled_;
  std::vector<std::pair<int, int>> chain_;  // parent and child of each joint that moves
};

// The two links of the robot alone, with their triangles.
bool triangles_touch(SceneInstance robot, int a, int b) {
  for (int link = 0; link < static_cast<int>(robot.shapes.size()); ++link) {
    if (link != a && link != b) robot.shapes[static_cast<std::size_t>(link)].clear();
  }
  SceneOptions options;
  options.detail = CollisionDetail::triangles;
  CollisionContext context(std::make_shared<const CollisionScene>(std::vector{std::move(robot)}, options));
  return context.closer({0, a}, {0, b}, -kTouching);
}

bool has_mesh(const Link& link) {
  return std::any_of(link.collisions.begin(), link.collisions.end(),
                     [](const Collision& c) { return std::holds_alternative<MeshGeometry>(c.geometry); });
}

double least_width(const Link& link) {
  double out = 0;
  for (const Collision& c : link.collisions) {
    if (const auto shape = report_shape(c.geometry)) out = std::max(out, shape->bounds.sizes().minCoeff());
  }
  return out;
}

// Two links that overlap, by index into RobotDescription::links, a < b, and into Model::links.
struct Overlap {
  int link_a = 0, link_b = 0;
  int model_a = 0, model_b = 0;
  double depth = 0;  // m
};

class Overlaps {
 public:
  Overlaps(const AuditInput& in, Findings& out)
      : in_(in), out_(out), bodies_(in.robot), robot_(described_robot(in.robot, *in.model)) {}

  void check() {
    std::vector<Overlap> contacts = find();
    const std::size_t told_before = out_.all().size();
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      if (out_.all().size() - told_before == kMaxReported) return report_rest(contacts.size() - i);
      const Overlap& contact = contacts[i];
      if (bodies_.neighbours(contact.link_a, contact.link_b)) {
        neighbours(contact);
      } else {
        apart(contact);
      }
    }
  }

 private:
  // The deepest first: the number of pairs that are checked by triangles is limited.
  [[nodiscard]] std::vector<Overlap> find() const {
    const auto index_of = [this](int link) {
      const std::string& name = in_.model->links[static_cast<std::size_t>(link)].name;
      return static_cast<int>(std::ranges::find(in_.robot.links, name, &Link::name) -
                              in_.robot.links.begin());
    };
    CollisionContext context(std::make_shared<const CollisionScene>(std::vector{robot_}));
    std::vector<Overlap> out;
    const auto add = [&](BodyId a, BodyId b) {
      const int i = index_of(a.link), k = index_of(b.link);
      if (bodies_.same(i, k) || !context.closer(a, b, -kDepth)) return;
      const double depth = -context.distance(a, b).distance;
      if (i < k)
        out.push_back({i, k, a.link, b.link, depth});
      else
        out.push_back({k, i, b.link, a.link, depth});
    };
    // Neighbours, which are allowed to touch, are judged by another measure.
    for (const auto& [a, b] : context.scene().tested_pairs()) add(a, b);
    for (const AllowedPair& pair : context.scene().allowed_pairs()) add(pair.a, pair.b);
    std::ranges::sort(out, [](const Overlap& x, const Overlap& y) {
      return std::tuple(-x.depth, x.link_a, x.link_b) < std::tuple(-y.depth, y.link_a, y.link_b);
    });
    return out;
  }

  [[nodiscard]] const Link& link(int index) const { return in_.robot.links[static_cast<std::size_t>(index)]; }
  [[nodiscard]] std::string subject(const Overlap& c) const {
    return fmt::format("links '{}' and '{}'", link(c.link_a).name, link(c.link_b).name);
  }

  void report_rest(std::size_t pairs) {
    out_.add("collision.overlap", Severity::note, "the robot", in_.robot.source,
             fmt::format("{} more pairs of links touch less deeply; the deepest ones are listed", pairs),
             "correct those first");
  }

  void neighbours(const Overlap& c) {
    // Hulls of parts that reach around each other overlap deeply without a fault; only exact shapes
    // can be judged.
    if (has_mesh(link(c.link_a)) || has_mesh(link(c.link_b))) return;
    const double width = std::min(least_width(link(c.link_a)), least_width(link(c.link_b)));
    if (width <= 0 || c.depth < kNeighbourShare * width) return;
    out_.add("collision.neighbours", subject(c), link(c.link_b).source,
             fmt::format("they share a joint and overlap by {:.1f} mm, more than half of the smallest extent "
                         "of the smaller one",
                         1000 * c.depth),
             "check the position of the shapes, or exclude the pair from collision checks");
  }

  void apart(const Overlap& c) {
    // Where one joint mimics the other, the links are meshing gears, or fingers that close on each other.
    if (bodies_.coupled(c.link_a, c.link_b)) return;
    const bool meshes = has_mesh(link(c.link_a)) || has_mesh(link(c.link_b));
    bool only_hulls = meshes;
    const std::size_t cost = collision_triangles(link(c.link_a)) + collision_triangles(link(c.link_b));
    if (meshes && cost <= triangles_left_) {
      triangles_left_ -= cost;
      only_hulls = !triangles_touch(robot_, c.model_a, c.model_b);
    }
    out_.add(
        "collision.overlap", only_hulls ? Severity::note : Severity::warning, subject(c),
        link(c.link_b).source,
        fmt::format(
            "they do not share a joint and overlap by {:.1f} mm with all joints at zero (or the limit "
            "nearest to zero){}",
            1000 * c.depth,
            only_hulls ? "; measured on their convex hulls, so the shapes themselves may not touch" : ""),
        only_hulls ? "nothing, if the shapes do not touch; physics engines that use hulls exclude the pair"
                   : "correct the shapes or the zero pose, or exclude the pair (SRDF disable_collisions)");
  }

  const AuditInput& in_;
  Findings& out_;
  Bodies bodies_;
  SceneInstance robot_;
  std::size_t triangles_left_ = kTriangles;
};

void check_missing(const AuditInput& in, Findings& out) {
  Names names;
  SourceLocation where;
  for (const Link& link : in.robot.links) {
    if (link.visuals.empty() || !link.collisions.empty()) continue;
    if (names.empty()) where = link.source;
    names.push_back(link.name);
  }
  const bool any = std::any_of(in.robot.links.begin(), in.robot.links.end(),
                               [](const Link& link) { return !link.collisions.empty(); });
  if (names.empty()) return;
  out.add("collision.missing", names.size() == 1 ? fmt::format("link '{}'", names[0]) : "the robot", where,
          any ? fmt::format("{} is visible but has no <collision>", quoted_list(names))
              : "no link has a <collision>; this robot collides with nothing",
          "add a <collision>; a box or a cylinder is enough");
}

}  // namespace

void check_collisions(const AuditInput& in, Findings& out) {
  check_missing(in, out);
  if (in.model != nullptr) Overlaps(in, out).check();
}

}  // namespace doppel::audit_rules
