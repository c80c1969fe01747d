#include "doppel/physics/contract/grasp.h"

#include <algorithm>

namespace doppel {
namespace {

// A contact of a link with a body that can be held.
struct Touch {
  BodyId link, body;
  Eigen::Vector3d normal_W, force_W;  // into the body, and on it
};

bool is_finger(const CompiledWorld& world, BodyId of) {
  return !of.is_ground() && has_fingers(world.instances()[static_cast<std::size_t>(of.instance)]);
}
bool is_holdable(const CompiledWorld& world, BodyId of) {
  return !of.is_ground() && can_be_held(world.instances()[static_cast<std::size_t>(of.instance)]);
}

Grasp& grasp_of(std::vector<Grasp>& grasps, const Touch& touch) {
  const auto found = std::ranges::find_if(
      grasps, [&](const Grasp& g) { return g.robot == touch.link.instance && g.body == touch.body; });
  if (found != grasps.end()) return *found;
  grasps.emplace_back();
  grasps.back().robot = touch.link.instance;
  grasps.back().body = touch.body;
  return grasps.back();
}

void add(Grasp& grasp, const Touch& touch, const Contact& contact) {
  auto at = std::ranges::find(grasp.links, touch.link.link, &GraspLink::link);
  if (at == grasp.links.end()) {
    at = grasp.links.emplace(at);
    at->link = touch.link.link;
  }
  const double pressure = std::max(touch.force_W.dot(touch.normal_W), 0.0);
  at->p_W += pressure * contact.p_W;
  at->normal_W += pressure * touch.normal_W;
  at->pressure += pressure;
  at->friction_W += touch.force_W - pressure * touch.normal_W;
  at->capacity += contact.friction * pressure;
}

bool holds(const Grasp& grasp) {
  for (std::size_t i = 0; i < grasp.links.size(); ++i) {
    for (std::size_t k = i + 1; k < grasp.links.size(); ++k) {
      if (opposed(grasp.links[i].normal_W, grasp.links[k].normal_W)) return true;
    }
  }
  return false;
}

}  // namespace

double Grasp::pressure() const {
  double out = 0;
  for (const GraspLink& link : links) out += link.pressure;
  return out;
}

double Grasp::capacity() const {
  double out = 0;
  for (const GraspLink& link : links) out += link.capacity;
  return out;
}

double Grasp::friction_used() const {
  double out = 0;
  for (const GraspLink& link : links) {
    if (link.capacity > 0) out = std::max(out, link.friction_W.norm() / link.capacity);
  }
  return std::min(out, 1.0);
}

void find_grasps(const CompiledWorld& world, std::span<const Contact> contacts, std::vector<Grasp>& out) {
  out.clear();
  for (const Contact& contact : contacts) {
    if (is_finger(world, contact.a) && is_holdable(world, contact.b))
      add(grasp_of(out, {contact.a, contact.b, {}, {}}),
          {contact.a, contact.b, contact.normal_W, contact.force_W}, contact);
    if (is_finger(world, contact.b) && is_holdable(world, contact.a))
      add(grasp_of(out, {contact.b, contact.a, {}, {}}),
          {contact.b, contact.a, -contact.normal_W, -contact.force_W}, contact);
  }
  for (Grasp& grasp : out) {
    std::erase_if(grasp.links, [](const GraspLink& link) { return link.pressure <= 0; });
    for (GraspLink& link : grasp.links) {
      link.p_W /= link.pressure;
      link.normal_W.normalize();
    }
    std::ranges::sort(grasp.links, {}, &GraspLink::link);
    grasp.supported = std::ranges::any_of(contacts, [&](const Contact& contact) {
      const bool first = contact.a == grasp.body;
      if (!first && contact.b != grasp.body) return false;
      const BodyId other = first ? contact.b : contact.a;
      return other.instance != grasp.robot && other.instance != grasp.body.instance &&
             contact.force_W.squaredNorm() > 0;
    });
  }
  std::erase_if(out, [](const Grasp& grasp) { return !holds(grasp); });
  std::ranges::sort(out, {}, [](const Grasp& grasp) { return std::pair(grasp.robot, grasp.body); });
}

}  // namespace doppel
