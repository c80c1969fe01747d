// Boxes, cylinders, capsules and spheres by themselves: without extent, or a thousand times too large.
#include <algorithm>
#include <array>

#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/inertia_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr double kLighterThanAir = 0.01;         // kg/m^3
constexpr double kLarge = 2;                     // m, of a link that may be in mm
constexpr double kWall = 5, kBeyondReach = 100;  // m, and against all the joints' offsets

struct Extent {
  std::string_view name;  // "radius"
  double value;
};
struct Primitive {
  std::string_view name;  // "box"; empty: a mesh
  std::vector<Extent> extents;
};

Primitive primitive(const Geometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry))
    return {"box",
            {{kAxisNames[0], box->size.x()}, {kAxisNames[1], box->size.y()}, {kAxisNames[2], box->size.z()}}};
  if (const auto* c = std::get_if<Cylinder>(&geometry))
    return {"cylinder", {{"radius", c->radius}, {"length", c->length}}};
  if (const auto* c = std::get_if<Capsule>(&geometry))
    return {"capsule", {{"radius", c->radius}, {"length", c->length}}};
  if (const auto* s = std::get_if<Sphere>(&geometry)) return {"sphere", {{"radius", s->radius}}};
  if (const auto* c = std::get_if<Cone>(&geometry))
    return {"cone", {{"radius", c->radius}, {"length", c->length}}};
  return {};
}

// A box that is flat along one axis is a sheet, which is visible.
bool sheet(const Primitive& p) {
  std::size_t zeros = 0;
  for (const Extent& e : p.extents) zeros += e.value == 0 ? 1 : 0;
  return zeros == 1 && p.name == "box";
}

void check_zero(const Link& link, const Geometry& geometry, const SourceLocation& where, bool collides,
                Findings& out) {
  const Primitive p = primitive(geometry);
  const bool flat = sheet(p);
  if (flat && !collides) return;
  for (const Extent& e : p.extents) {
    // A capsule without length is a ball.
    if (e.value != 0 || (p.name == "capsule" && e.name == "length")) continue;
    Finding& f =
        out.add("shape.zero_size", flat ? Severity::note : Severity::warning, subject(link), where,
                fmt::format("the {}{} of the <{}> of its <{}> is 0", p.name == "box" ? "size along " : "",
                            e.name, p.name, collides ? "collision" : "visual"));
    if (flat) f.consequence = "it has no volume: fast objects pass through it, and MuJoCo rejects it";
    return;
  }
}

std::string in_metres(const Primitive& p) {
  std::string out;
  if (p.name == "box") {
    return fmt::format("size=\"{:g} {:g} {:g}\"", p.extents[0].value / 1e3, p.extents[1].value / 1e3,
                       p.extents[2].value / 1e3);
  }
  for (const Extent& e : p.extents)
    out += fmt::format("{}{}=\"{:g}\"", out.empty() ? "" : " ", e.name, e.value / 1e3);
  return out;
}

template <class Elements>
const typename Elements::value_type* largest_primitive(const Elements& elements) {
  const typename Elements::value_type* best = nullptr;
  double most = 0;
  for (const auto& element : elements) {
    if (std::holds_alternative<MeshGeometry>(element.geometry)) return nullptr;
    const double size = report_shape(element.geometry)->bounds.diagonal().norm();
    if (size > most) best = &element;
    most = std::max(most, size);
  }
  return best;
}

// All of a link's shapes are primitives, and as written its mass is below that of the displaced air; at a
// thousandth of the size its density is plausible.
bool lighter_than_air(const Link& link, const LinkShape& shape) {
  if (!link.inertial || !(link.inertial->mass > 0) || !(shape.solid.volume > 0)) return false;
  const double density = link.inertial->mass / shape.solid.volume;
  return shape.size() > kLarge && density < kLighterThanAir && density * 1e9 > kMinDensity &&
         density * 1e9 < kMaxDensity;
}

void check_units(const Link& link, double reach, Findings& out) {
  const auto* visual = largest_primitive(link.visuals);
  const auto* collision = largest_primitive(link.collisions);
  if ((visual == nullptr && !link.visuals.empty()) || (visual == nullptr && collision == nullptr)) return;
  const auto shape = link_shape(link);
  if (!shape) return;
  const bool certain = lighter_than_air(link, *shape);
  const bool beyond = !link.inertial && reach > 0 && shape->bounds.sizes().minCoeff() > kWall &&
                      shape->size() > kBeyondReach * reach;
  if (!certain && !beyond) return;
  const Primitive p = primitive(visual != nullptr ? visual->geometry : collision->geometry);
  const std::string why = certain
                              ? fmt::format("at {:g} kg it would be {:.2g} kg/m^3, lighter than air",
                                            link.inertial->mass, link.inertial->mass / shape->solid.volume)
                              : fmt::format("all the joints' offsets together are {:.3g} m", reach);
  out.add("shape.units", certain ? Severity::error : Severity::warning, subject(link),
          visual != nullptr ? visual->source : collision->source,
          fmt::format("its <{}> is {:.3g} m long, and {}: it is in millimetres", p.name, shape->size(), why),
          fmt::format("write {}, and likewise in its other shapes", in_metres(p)));
}

}  // namespace

void check_shapes(const AuditInput& in, Findings& out) {
  double reach = 0;
  for (const Joint& joint : in.robot.joints) reach += joint.origin.xyz.norm();
  for (const Link& link : in.robot.links) {
    for (const Visual& v : link.visuals) check_zero(link, v.geometry, v.source, false, out);
    for (const Collision& c : link.collisions) check_zero(link, c.geometry, c.source, true, out);
    check_units(link, reach, out);
  }
}

}  // namespace doppel::audit_rules
