// Surfaces of shapes as triangles, with normals of the shape itself and coordinates of textures as in Gazebo: once
// around a cylinder and over its height, once over each face of a box.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/base/core/overloaded.h"
#include "doppel/description/meshes/heightmap.h"
#include "doppel/description/meshes/shape_mesh.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kTau = 2 * std::numbers::pi;

int corners_of(double radius) {
  const double needed = std::numbers::pi * std::sqrt(std::max(radius, 1e-6) / (2 * kChordError));
  return std::clamp(4 * static_cast<int>(std::ceil(needed / 4)), 24, 256);
}

class SurfaceWriter {
 public:
  std::uint32_t corner(const Vector3d& p, const Vector3d& normal, double u, double v) {
    mesh_.positions.push_back(p.cast<float>());
    mesh_.normals.push_back(normal.normalized().cast<float>());
    mesh_.uvs.emplace_back(static_cast<float>(u), static_cast<float>(v));
    return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh_.triangles.push_back({a, b, c}); }

  // A rectangle p + s a + t b with s and t from -1 to 1; a x b points outwards.
  void face(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
    const Vector3d normal = a.cross(b);
    const std::uint32_t at = corner(p - a - b, normal, 0, 1);
    corner(p + a - b, normal, 1, 1);
    corner(p + a + b, normal, 1, 0);
    corner(p - a + b, normal, 0, 0);
    triangle(at, at + 1, at + 2);
    triangle(at, at + 2, at + 3);
  }

  struct Ring {
    double radius, z;      // m
    double radial, axial;  // of the normal
    double v;              // of the texture
  };
  // Around z, between each ring and the next; rings from the bottom to the top.
  void revolve(const std::vector<Ring>& rings, int corners) {
    const auto base = static_cast<std::uint32_t>(mesh_.positions.size());
    const auto row = static_cast<std::uint32_t>(corners + 1);
    for (const Ring& ring : rings)
      for (int i = 0; i <= corners; ++i) {
        const double angle = kTau * i / corners;
        const Vector3d out(std::cos(angle), std::sin(angle), 0);
        corner(ring.radius * out + Vector3d(0, 0, ring.z), ring.radial * out + Vector3d(0, 0, ring.axial),
               static_cast<double>(i) / corners, ring.v);
      }
    for (std::uint32_t r = 0; r + 1 < rings.size(); ++r)
      for (std::uint32_t i = 0; i + 1 < row; ++i) {
        const std::uint32_t a = base + r * row + i, b = a + 1, c = a + row + 1, d = a + row;
        if (rings[r].radius > 0) triangle(a, b, c);
        if (rings[r + 1].radius > 0) triangle(a, c, d);
      }
  }
  void disc(double radius, double z, int corners) {
    const double up = z > 0 ? 1 : -1;
    const std::uint32_t centre = corner({0, 0, z}, {0, 0, up}, 0.5, 0.5);
    for (int i = 0; i <= corners; ++i) {
      const double x = std::cos(kTau * i / corners), y = up * std::sin(kTau * i / corners);
      corner({radius * x, radius * y, z}, {0, 0, up}, 0.5 + 0.5 * x, 0.5 - 0.5 * y);
    }
    for (std::uint32_t i = 1; i <= static_cast<std::uint32_t>(corners); ++i)
      triangle(centre, centre + i, centre + i + 1);
  }

  SurfaceMesh finish() {
    mesh_.parts.push_back({0, static_cast<std::uint32_t>(mesh_.triangles.size()), -1});
    return std::move(mesh_);
  }

 private:
  SurfaceMesh mesh_;
};

SurfaceMesh box_surface(const Vector3d& size) {
  SurfaceWriter out;
  const Vector3d h = size / 2, x(h.x(), 0, 0), y(0, h.y(), 0), z(0, 0, h.z());
  out.face(x, y, z);
  out.face(-x, -y, z);
  out.face(y, -x, z);
  out.face(-y, x, z);
  out.face(z, x, y);
  out.face(-z, -x, y);
  return out.finish();
}

SurfaceMesh ellipsoid_surface(const Vector3d& radii) {
  SurfaceWriter out;
  const int corners = corners_of(radii.maxCoeff()), rows = corners / 2;
  std::vector<SurfaceWriter::Ring> rings;
  for (int i = 0; i <= rows; ++i) {
    const double angle = std::numbers::pi * (static_cast<double>(i) / rows - 0.5);
    const double radius = i == 0 || i == rows ? 0 : std::cos(angle);
    rings.push_back({radius, std::sin(angle), radius, std::sin(angle), 1 - static_cast<double>(i) / rows});
  }
  out.revolve(rings, corners);
  SurfaceMesh mesh = out.finish();
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    mesh.positions[i] = mesh.positions[i].cwiseProduct(radii.cast<float>());
    mesh.normals[i] = mesh.normals[i].cwiseQuotient(radii.cast<float>()).normalized();
  }
  return mesh;
}

SurfaceMesh cylinder_surface(double radius, double length) {
  SurfaceWriter out;
  const int corners = corners_of(radius);
  out.revolve({{radius, -length / 2, 1, 0, 1}, {radius, length / 2, 1, 0, 0}}, corners);
  out.disc(radius, length / 2, corners);
  out.disc(radius, -length / 2, corners);
  return out.finish();
}

SurfaceMesh capsule_surface(double radius, double length) {
  SurfaceWriter out;
  const int corners = corners_of(radius), rows = corners / 4;
  const double whole = length + 2 * radius;
  std::vector<SurfaceWriter::Ring> rings;
  for (const int side : {-1, 1})
    for (int i = 0; i <= rows; ++i) {
      const double angle = std::numbers::pi / 2 *
                           (side < 0 ? static_cast<double>(i) / rows - 1 : static_cast<double>(i) / rows);
      const bool pole = side < 0 ? i == 0 : i == rows;
      const double radial = pole ? 0 : std::cos(angle), z = side * length / 2 + radius * std::sin(angle);
      rings.push_back({radius * radial, z, radial, std::sin(angle), 0.5 - z / whole});
    }
  out.revolve(rings, corners);
  return out.finish();
}

SurfaceMesh cone_surface(const Cone& cone) {
  SurfaceWriter out;
  const int corners = corners_of(cone.radius);
  out.revolve({{cone.radius, -cone.length / 2, cone.length, cone.radius, 1},
               {0, cone.length / 2, cone.length, cone.radius, 0}},
              corners);
  out.disc(cone.radius, -cone.length / 2, corners);
  return out.finish();
}

SurfaceMesh plane_surface(const Plane& plane) {
  SurfaceWriter out;
  const Eigen::Matrix3d R = rotation_from_z(plane.normal);
  out.face(Vector3d::Zero(), R.col(0) * plane.size.x() / 2, R.col(1) * plane.size.y() / 2);
  return out.finish();
}

SurfaceMesh extrusion_surface(const Extrusion& extrusion) {
  const TriangleMesh mesh = surface_mesh(extrusion);
  SurfaceMesh out = with_normals(mesh.vertices, mesh.triangles, 0.1);
  const Eigen::AlignedBox3f box = mesh.bounds();
  const Vector3f size = box.sizes().cwiseMax(1e-6F);
  for (std::size_t i = 0; i < out.positions.size(); ++i) {
    const Vector3f p = (out.positions[i] - box.min()).cwiseQuotient(size), n = out.normals[i].cwiseAbs();
    out.uvs.push_back(n.z() > 0.9F ? Vector2f(p.x(), 1 - p.y())
                                   : Vector2f(n.x() > n.y() ? p.y() : p.x(), 1 - p.z()));
  }
  return out;
}

SurfaceMesh heightmap_surface(const Heightmap& map) {
  if (!map.field) return {};
  const HeightField& field = *map.field;
  std::vector<Vector3f> points;
  for (int r = 0; r < field.rows; ++r)
    for (int c = 0; c < field.columns; ++c) points.push_back(field.point(c, r).cast<float>());
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (int r = 0; r + 1 < field.rows; ++r)
    for (int c = 0; c + 1 < field.columns; ++c) {
      const auto at = static_cast<std::uint32_t>(r * field.columns + c),
                 up = at + static_cast<std::uint32_t>(field.columns);
      triangles.push_back({at, at + 1, up + 1});
      triangles.push_back({at, up + 1, up});
    }
  SurfaceMesh out = with_normals(points, triangles, 1.2);
  const double repetition = map.textures.empty() ? 10 : std::max(1e-3, map.textures.front().size);
  for (const Vector3f& p : out.positions)
    out.uvs.emplace_back((Vector2f(p.x(), -p.y()) / static_cast<float>(repetition)));
  return out;
}

}  // namespace

SurfaceMesh surface_of(const Geometry& shape) {
  return std::visit(
      Overloaded{[](const Box& box) { return box_surface(box.size); },
                 [](const Cylinder& c) { return cylinder_surface(c.radius, c.length); },
                 [](const Capsule& c) { return capsule_surface(c.radius, c.length); },
                 [](const Sphere& sphere) { return ellipsoid_surface(Vector3d::Constant(sphere.radius)); },
                 [](const Ellipsoid& ellipsoid) { return ellipsoid_surface(ellipsoid.radii); },
                 [](const Cone& cone) { return cone_surface(cone); },
                 [](const Plane& plane) { return plane_surface(plane); },
                 [](const Extrusion& extrusion) { return extrusion_surface(extrusion); },
                 [](const Heightmap& map) { return heightmap_surface(map); },
                 [](const MeshGeometry& mesh) { return load_appearance(mesh).mesh; }},
      shape);
}

}  // namespace doppel
