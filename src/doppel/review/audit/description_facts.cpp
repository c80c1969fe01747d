#include "doppel/review/audit/detail/description_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace doppel::audit_rules {
namespace {

MassProperties written(const Inertial& inertial) {
  return transformed({inertial.mass, Eigen::Vector3d::Zero(), inertial.tensor()}, inertial.origin.pose());
}

class BodyFinder {
 public:
  explicit BodyFinder(const RobotDescription& robot) {
    std::set<std::string_view> children;
    for (const Link& link : robot.links) links_.emplace(link.name, &link);
    for (const Joint& joint : robot.joints) {
      joints_of_[joint.parent].push_back(&joint);
      children.insert(joint.child);
    }
    for (const Link& link : robot.links) {
      if (!children.contains(link.name)) start(link, nullptr);
    }
    while (!waiting_.empty()) {
      const auto [link, joint] = waiting_.back();
      waiting_.pop_back();
      if (seen_.contains(link->name)) continue;  // in a loop two joints lead to one link
      out_.emplace_back();
      out_.back().joint = joint;
      gather(*link, Pose::Identity());
    }
  }
  std::vector<Body> take() { return std::move(out_); }

 private:
  void start(const Link& link, const Joint* joint) { waiting_.emplace_back(&link, joint); }

  void gather(const Link& first, const Pose& X_first) {
    std::vector<std::pair<const Link*, Pose>> fixed{{&first, X_first}};
    while (!fixed.empty()) {
      const auto [link, X_BL] = fixed.back();
      fixed.pop_back();
      if (!seen_.insert(link->name).second) continue;
      Body& body = out_.back();
      body.links.push_back(link);
      if (link->inertial) {
        body.weighed = true;
        body.mass = combined(body.mass, transformed(written(*link->inertial), X_BL));
      }
      for (const Joint* joint : joints_of_[link->name]) {
        const auto child = links_.find(joint->child);
        if (child == links_.end()) continue;
        if (joint->type == JointType::fixed)
          fixed.emplace_back(child->second, X_BL * joint->origin.pose());
        else
          start(*child->second, joint);
      }
    }
  }

  std::map<std::string_view, const Link*> links_;
  std::map<std::string_view, std::vector<const Joint*>> joints_of_;
  std::set<std::string_view> seen_;
  std::vector<std::pair<const Link*, const Joint*>> waiting_;
  std::vector<Body> out_;
};

template <class Elements>
bool gather_shapes(const Elements& elements, LinkShape& out, MassProperties& solid, bool& closed) {
  for (const auto& element : elements) {
    const auto shape = report_shape(element.geometry);
    if (!shape) return false;
    const Pose X_LS = element.origin.pose();
    for (const Eigen::Vector3d& p : shape->hull) {
      out.hull.push_back(X_LS * p);
      out.bounds.extend(out.hull.back());
    }
    closed = closed && shape->watertight && shape->solid.volume != 0;
    MassProperties part = shape->solid.unit;
    if (part.mass < 0) part = {-part.mass, part.com, -part.I};
    solid = combined(solid, transformed(part, X_LS));
    out.hull_volume += shape->hull_volume;
  }
  return true;
}

}  // namespace

std::string subject(const Joint& joint) {
  return fmt::format("joint '{}'", joint.name);
}

std::string subject(const Link& link) {
  return fmt::format("link '{}'", link.name);
}

bool same_place(const SourceLocation& a, const SourceLocation& b) {
  return a.line == b.line && a.column == b.column && a.within == b.within && a.known() && b.known() &&
         (a.file == b.file || *a.file == *b.file);
}

bool holds(const XmlNode& node, const SourceLocation& where) {
  if (same_place(node.where, where)) return true;
  for (const XmlAttribute& attribute : node.attributes) {
    if (same_place(attribute.where, where)) return true;
  }
  return std::any_of(node.children.begin(), node.children.end(),
                     [&](const XmlNode& child) { return holds(child, where); });
}

const XmlNode* element_at(const XmlNode& root, const SourceLocation& where) {
  if (root.kind == XmlNode::Kind::element && same_place(root.where, where)) return &root;
  for (const XmlNode& child : root.children) {
    if (const XmlNode* found = element_at(child, where)) return found;
  }
  return nullptr;
}

std::string names_of(const std::vector<std::string>& names, std::size_t at_most) {
  std::string out;
  const std::size_t shown = names.size() <= at_most + 1 ? names.size() : at_most;
  for (std::size_t i = 0; i < shown; ++i) {
    const bool last = i + 1 == names.size();
    out += fmt::format("{}'{}'", i == 0 ? "" : last ? " and " : ", ", names[i]);
  }
  if (shown < names.size()) out += fmt::format(" and {} more", names.size() - shown);
  return out;
}

std::vector<Body> bodies(const RobotDescription& robot) {
  return BodyFinder(robot).take();
}

std::size_t collision_triangles(const Link& link) {
  std::size_t count = 0;
  for (const Collision& c : link.collisions) {
    const auto* mesh = std::get_if<MeshGeometry>(&c.geometry);
    if (mesh != nullptr && !mesh->path.empty()) count += cached_mesh_report(mesh->path).triangles;
  }
  return count;
}

std::optional<LinkShape> link_shape(const Link& link) {
  LinkShape out;
  MassProperties visuals, collisions;
  bool closed = true, closed_collisions = true;
  if (!gather_shapes(link.visuals, out, visuals, closed)) return std::nullopt;
  const double visual_volume = out.hull_volume;
  if (!gather_shapes(link.collisions, out, collisions, closed_collisions)) return std::nullopt;
  if (out.hull.empty()) return std::nullopt;
  if (!link.visuals.empty()) out.hull_volume = visual_volume;
  const bool by_visuals = !link.visuals.empty();
  if (by_visuals ? closed : closed_collisions) {
    out.solid.unit = by_visuals ? visuals : collisions;
    out.solid.volume = out.solid.unit.mass;
  }
  return out;
}

}  // namespace doppel::audit_rules
