#include "doppel/robot/kinematics/link_solid.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "doppel/description/meshes/mesh.h"
#include "doppel/description/meshes/shape_mesh.h"
#include "doppel/robot/kinematics/link_inertia.h"

namespace doppel {
namespace {

constexpr double kBoxFraction = 0.3;  // part of its bounding box that an open mesh is assumed to fill
constexpr double kMinFilled = 0.02;   // of its bounding box: a "solid" below that is a surface

MassProperties solid(double volume, const Eigen::Vector3d& moments_per_mass) {
  const double mass = volume * kAssumedDensity;
  return {mass, Eigen::Vector3d::Zero(), (mass * moments_per_mass).asDiagonal()};
}

MassProperties box(const Eigen::Vector3d& size, double filled = 1.0) {
  const Eigen::Vector3d s = size.cwiseAbs2() / 12.0;
  return solid(filled * size.prod(), {s.y() + s.z(), s.x() + s.z(), s.x() + s.y()});
}

MassProperties mesh_solid(const TriangleMesh& triangles) {
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3f& p : triangles.vertices) bounds.extend(p.cast<double>());
  if (bounds.isEmpty()) return {};
  const SolidProperties properties = solid_properties(triangles.vertices, triangles.triangles);
  const double filled = std::abs(properties.volume) / bounds.volume();
  if (filled >= kMinFilled && filled <= 1.0) {
    MassProperties body = properties.unit;
    const double factor = properties.volume < 0 ? -kAssumedDensity : kAssumedDensity;
    body.mass *= factor;
    body.I *= factor;
    if (physical_defect(body).empty()) return body;
  }
  MassProperties body = box(bounds.sizes(), kBoxFraction);
  body.com = bounds.center();
  return body;
}

// The centre of mass is a quarter of the length above the base.
MassProperties solid_cone(const Cone& c) {
  const double across = 3.0 / 80.0 * (4.0 * c.radius * c.radius + c.length * c.length);
  MassProperties body = solid(std::numbers::pi * c.radius * c.radius * c.length / 3.0,
                              {across, across, 0.3 * c.radius * c.radius});
  body.com.z() = -0.25 * c.length;
  return body;
}

// The solid that a shape encloses, in the shape's frame; mass 0: it encloses nothing.
MassProperties solid_of(const Geometry& geometry) {
  if (const auto* b = std::get_if<Box>(&geometry)) return box(b->size);
  if (const auto* c = std::get_if<Cylinder>(&geometry)) return solid_cylinder(c->radius, c->length);
  // The caps lengthen the cylinder by two thirds of the radius each: same volume, nearly the same moments.
  if (const auto* c = std::get_if<Capsule>(&geometry))
    return solid_cylinder(c->radius, c->length + 4.0 / 3.0 * c->radius);
  if (const auto* s = std::get_if<Sphere>(&geometry)) return solid_ball(s->radius);
  if (const auto* e = std::get_if<Ellipsoid>(&geometry)) {
    const Eigen::Vector3d s = e->radii.cwiseAbs2() / 5.0;
    return solid(4.0 / 3.0 * std::numbers::pi * e->radii.prod(),
                 {s.y() + s.z(), s.x() + s.z(), s.x() + s.y()});
  }
  if (const auto* c = std::get_if<Cone>(&geometry)) return solid_cone(*c);
  if (const auto* e = std::get_if<Extrusion>(&geometry)) return mesh_solid(surface_mesh(*e));
  const auto* const mesh = std::get_if<MeshGeometry>(&geometry);
  if (mesh == nullptr || mesh->path.empty()) return {};
  try {
    return mesh_solid(load_mesh(*mesh));
  } catch (const InputError&) {
    return {};  // an unreadable mesh is reported where the collision shapes are made
  }
}

template <typename Elements>
MassProperties sum_of_shapes(const Elements& elements) {
  MassProperties sum;
  for (const auto& element : elements) {
    const MassProperties part = solid_of(element.geometry);
    if (part.mass > 0 && part.com.allFinite()) sum = combined(sum, transformed(part, element.origin.pose()));
  }
  return sum;
}

}  // namespace

MassProperties solid_cylinder(double radius, double length) {
  const double across = (3.0 * radius * radius + length * length) / 12.0;
  return solid(std::numbers::pi * radius * radius * length, {across, across, radius * radius / 2.0});
}

MassProperties solid_ball(double radius) {
  return solid(4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3),
               Eigen::Vector3d::Constant(0.4 * radius * radius));
}

MassProperties shape_solid(const Geometry& geometry, double density) {
  MassProperties out = solid_of(geometry);
  out.mass *= density / kAssumedDensity;
  out.I *= density / kAssumedDensity;
  return out;
}

MassProperties link_solid(const Link& link) {
  MassProperties out = sum_of_shapes(link.collisions);
  if (!(out.mass > kMinSolidMass)) out = sum_of_shapes(link.visuals);
  return out;
}

}  // namespace doppel
