#include "doppel/robot/clearance/cover_geometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/base/core/overloaded.h"
#include "doppel/description/meshes/convex_hull.h"

namespace doppel {
namespace {

constexpr std::uint32_t kCorners = 64, kRings = 16;  // of a circle, and of half a ball
constexpr double kFieldDepth = 1.0;                  // m, of the solid below a terrain's lowest point

// True if every edge has as many triangles in the one direction as in the other.
bool is_closed(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<std::pair<std::uint64_t, int>> edges;
  edges.reserve(triangles.size() * 3);
  for (const auto& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t a = t[i], b = t[(i + 1) % 3];
      if (a != b) edges.emplace_back(std::min(a, b) << 32 | std::max(a, b), a < b ? 1 : -1);
    }
  }
  std::ranges::sort(edges);
  for (std::size_t i = 0; i < edges.size();) {
    const std::uint64_t edge = edges[i].first;
    int sum = 0;
    for (; i < edges.size() && edges[i].first == edge; ++i) sum += edges[i].second;
    if (sum != 0) return false;
  }
  return !triangles.empty();
}

CoverGeometry cuboid_of(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  CoverGeometry out;
  for (int i = 0; i < 8; ++i)
    out.vertices.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                              i & 4 ? high.z() : low.z());
  out.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return out;
}

// The surface between polygons of kCorners corners about z, one above the other, and a point at each end.
void join_rings(CoverGeometry& out, std::uint32_t rings) {
  const std::uint32_t bottom = rings * kCorners, top = bottom + 1;
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    const std::uint32_t next = (i + 1) % kCorners;
    out.triangles.push_back({bottom, next, i});
    const std::uint32_t last = (rings - 1) * kCorners;
    out.triangles.push_back({top, last + i, last + next});
    for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
      const std::uint32_t low = ring * kCorners, high = low + kCorners;
      out.triangles.push_back({low + i, low + next, high + i});
      out.triangles.push_back({low + next, high + next, high + i});
    }
  }
}

void add_ring(CoverGeometry& out, double radius, double z) {
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    out.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
}

CoverGeometry prism_around(const Cylinder& cylinder) {
  CoverGeometry out;
  const double radius = cylinder.radius / std::cos(std::numbers::pi / kCorners);
  add_ring(out, radius, -cylinder.length / 2);
  add_ring(out, radius, cylinder.length / 2);
  out.vertices.emplace_back(0, 0, -cylinder.length / 2);
  out.vertices.emplace_back(0, 0, cylinder.length / 2);
  join_rings(out, 2);
  return out;
}

// A polyhedron around the ball of radius 1 whose halves are `length` apart.
CoverGeometry around_unit_capsule(double length) {
  CoverGeometry out;
  for (const double side : {-1.0, 1.0}) {
    for (std::uint32_t ring = 0; ring < kRings; ++ring) {
      const double step = side < 0 ? kRings - 1 - ring : ring;
      const double latitude = step * std::numbers::pi / 2 / kRings;
      add_ring(out, std::cos(latitude), side * std::sin(latitude));
    }
  }
  out.vertices.emplace_back(0, 0, -1);
  out.vertices.emplace_back(0, 0, 1);
  join_rings(out, 2 * kRings);
  double nearest = 1;  // of the faces' planes
  for (const auto& t : out.triangles) {
    const Eigen::Vector3d a = out.vertices[t[0]];
    const Eigen::Vector3d normal = (out.vertices[t[1]] - a).cross(out.vertices[t[2]] - a);
    if (normal.norm() > 1e-9) nearest = std::min(nearest, std::abs(normal.normalized().dot(a)));
  }
  for (std::size_t i = 0; i < out.vertices.size(); ++i) {
    out.vertices[i] /= nearest;
    const bool upper = i < 2 * kRings * kCorners ? i >= kRings * kCorners : i == out.vertices.size() - 1;
    out.vertices[i].z() += (upper ? 0.5 : -0.5) * length;
  }
  return out;
}

CoverGeometry capsule_of(const Capsule& capsule) {
  CoverGeometry out = around_unit_capsule(capsule.length / capsule.radius);
  for (Eigen::Vector3d& p : out.vertices) p *= capsule.radius;
  const Eigen::Vector3d end(0, 0, capsule.length / 2);
  out.core = {-end, end, end};
  out.rounding = capsule.radius;
  return out;
}

CoverGeometry ball_of(const Sphere& sphere) {
  CoverGeometry out;
  out.ball = CoverSphere{Eigen::Vector3d::Zero(), sphere.radius};
  out.core.assign(3, Eigen::Vector3d::Zero());
  out.rounding = sphere.radius;
  return out;
}

CoverGeometry hull_of(const CollisionHull& hull) {
  CoverGeometry out;
  for (const Eigen::Vector3f& p : hull.vertices) out.vertices.push_back(p.cast<double>());
  out.triangles = convex_hull(hull.vertices).triangles;
  return out;
}

CoverGeometry field_of(const HeightField& field) {
  const auto [low, high] = std::ranges::minmax(field.heights);
  const Eigen::Vector2d half = field.size / 2;
  return cuboid_of({-half.x(), -half.y(), low - kFieldDepth}, {half.x(), half.y(), high});
}

}  // namespace

CoverGeometry cover_geometry(const TriangleMesh& mesh) {
  CoverGeometry out;
  out.vertices.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& p : mesh.vertices) out.vertices.push_back(p.cast<double>());
  out.triangles = mesh.triangles;
  out.closed = is_closed(out.triangles);
  return out;
}

CoverGeometry cover_geometry(const CollisionShape& shape) {
  CoverGeometry out = std::visit(
      Overloaded{[](const Box& s) { return cuboid_of(-s.size / 2, s.size / 2); },
                 [](const Cylinder& s) { return prism_around(s); },
                 [](const Capsule& s) { return capsule_of(s); }, [](const Sphere& s) { return ball_of(s); },
                 [](const Ellipsoid& s) {
                   CoverGeometry polyhedron = around_unit_capsule(0);
                   for (Eigen::Vector3d& p : polyhedron.vertices) p = p.cwiseProduct(s.radii);
                   return polyhedron;
                 },
                 [](const SharedHull& s) { return hull_of(*s); },
                 [](const SharedField& s) { return field_of(*s); }},
      shape.geometry);
  out.closed = true;
  return out;
}

}  // namespace doppel
