// Shapes of links: primitives by formula, meshes by their reports.
#include <cmath>
#include <numbers>

#include "doppel/description/meshes/convex_hull.h"
#include "doppel/description/meshes/mesh_report.h"
#include "doppel/description/meshes/shape_mesh.h"

namespace doppel {
namespace {

constexpr int kRound = 48;  // corners that approximate a circle
constexpr int kBall = 500;  // corners that approximate a sphere
constexpr double kPi = std::numbers::pi;

ShapeReport solid_report(double volume, const Eigen::Vector3d& moments_per_mass,
                         const Eigen::Vector3d& half) {
  ShapeReport out;
  out.bounds = {Eigen::Vector3d(-half), half};
  out.solid.volume = out.hull_volume = volume;
  out.solid.unit = {volume, Eigen::Vector3d::Zero(), (volume * moments_per_mass).asDiagonal()};
  return out;
}

ShapeReport report(const Box& box) {
  const Eigen::Vector3d half = 0.5 * box.size;
  const Eigen::Vector3d s = box.size.cwiseAbs2() / 12.0;
  ShapeReport out = solid_report(box.size.prod(), {s.y() + s.z(), s.x() + s.z(), s.x() + s.y()}, half);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    out.hull.push_back(half.cwiseProduct(sign));
  }
  return out;
}

ShapeReport report(const Cylinder& c) {
  const double across = (3.0 * c.radius * c.radius + c.length * c.length) / 12.0;
  ShapeReport out =
      solid_report(kPi * c.radius * c.radius * c.length, {across, across, c.radius * c.radius / 2.0},
                   {c.radius, c.radius, 0.5 * c.length});
  for (int i = 0; i < kRound; ++i) {
    const double angle = 2.0 * kPi * i / kRound;
    for (const double z : {-0.5, 0.5}) {
      out.hull.emplace_back(c.radius * std::cos(angle), c.radius * std::sin(angle), z * c.length);
    }
  }
  return out;
}

// A cylinder with two half balls: the moments of a half ball about its own centre of mass, moved out by
// L/2 + 3r/8.
ShapeReport report(const Capsule& c) {
  const double r = c.radius, l = c.length;
  const double tube = kPi * r * r * l, ball = 4.0 / 3.0 * kPi * r * r * r;
  const double along = tube * r * r / 2.0 + ball * 0.4 * r * r;
  const double across =
      tube * (3.0 * r * r + l * l) / 12.0 + ball * (0.4 * r * r + 0.25 * l * l + 3.0 / 8.0 * l * r);
  const double volume = tube + ball;
  const double per_mass = volume > 0 ? 1.0 / volume : 0.0;
  ShapeReport out =
      solid_report(volume, {across * per_mass, across * per_mass, along * per_mass}, {r, r, 0.5 * l + r});
  for (const Eigen::Vector3d& d : even_directions(kBall)) {
    out.hull.emplace_back(r * d + Eigen::Vector3d(0, 0, d.z() < 0 ? -0.5 * l : 0.5 * l));
  }
  return out;
}

ShapeReport report(const Sphere& s) {
  const double moment = 0.4 * s.radius * s.radius;
  ShapeReport out = solid_report(4.0 / 3.0 * kPi * s.radius * s.radius * s.radius, {moment, moment, moment},
                                 Eigen::Vector3d::Constant(s.radius));
  for (const Eigen::Vector3d& d : even_directions(kBall)) out.hull.emplace_back(s.radius * d);
  return out;
}

SolidProperties scaled(const SolidProperties& solid, const Eigen::Vector3d& scale) {
  SolidProperties out;
  const double factor = std::abs(scale.prod());
  out.volume = solid.volume * factor;
  out.unit.mass = solid.unit.mass * factor;
  out.unit.com = solid.unit.com.cwiseProduct(scale);
  const Eigen::Matrix3d second = 0.5 * solid.unit.I.trace() * Eigen::Matrix3d::Identity() - solid.unit.I;
  const Eigen::Matrix3d moved = factor * (scale.asDiagonal() * second * scale.asDiagonal());
  out.unit.I = moved.trace() * Eigen::Matrix3d::Identity() - moved;
  return out;
}

template <class Shape>
ShapeReport report(const Shape& shape) requires requires {
  surface_mesh(shape);
}
{
  const TriangleMesh convex = surface_mesh(shape);
  ShapeReport out;
  out.bounds = convex.bounds().cast<double>();
  out.solid = solid_properties(convex.vertices, convex.triangles);
  out.hull_volume = out.solid.volume;
  for (const Eigen::Vector3f& p : convex.vertices) out.hull.push_back(p.cast<double>());
  return out;
}

std::optional<ShapeReport> report(const Plane&) {
  return std::nullopt;
}

std::optional<ShapeReport> report(const Heightmap&) {
  return std::nullopt;
}

std::optional<ShapeReport> report(const MeshGeometry& geometry) {
  if (geometry.path.empty()) return std::nullopt;
  const MeshReport& mesh = cached_mesh_report(geometry.path);
  if (!mesh.problem.empty()) return std::nullopt;
  ShapeReport out;
  out.bounds.extend(mesh.lower.cwiseProduct(geometry.scale));
  out.bounds.extend(mesh.upper.cwiseProduct(geometry.scale));
  out.solid = scaled(mesh.solid, geometry.scale);
  out.hull_volume = mesh.hull_volume * std::abs(geometry.scale.prod());
  out.watertight = mesh.watertight();
  for (const Eigen::Vector3f& p : mesh.hull)
    out.hull.emplace_back(p.cast<double>().cwiseProduct(geometry.scale));
  return out;
}

}  // namespace

std::optional<ShapeReport> report_shape(const Geometry& geometry) {
  return std::visit([](const auto& shape) -> std::optional<ShapeReport> { return report(shape); }, geometry);
}

}  // namespace doppel
