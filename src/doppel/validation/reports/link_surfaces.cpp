#include "doppel/validation/reports/detail/link_surfaces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/overloaded.h"
#include "doppel/description/meshes/mesh.h"
#include "doppel/description/meshes/shape_mesh.h"

namespace doppel {
namespace {

TriangleMesh prism(const std::vector<Eigen::Vector2d>& outline, double height) {
  TriangleMesh out = surface_mesh(Extrusion{outline, height});
  for (Eigen::Vector3f& v : out.vertices) v.z() -= static_cast<float>(height / 2);
  return out;
}

TriangleMesh box_mesh(const Eigen::Vector3d& size) {
  const double x = size.x() / 2, y = size.y() / 2;
  return prism({{-x, -y}, {x, -y}, {x, y}, {-x, y}}, size.z());
}

TriangleMesh cylinder_mesh(const Cylinder& cylinder) {
  std::vector<Eigen::Vector2d> rim;
  for (int i = 0; i < kRoundCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRoundCorners;
    rim.emplace_back(cylinder.radius * std::cos(angle), cylinder.radius * std::sin(angle));
  }
  return prism(rim, cylinder.length);
}

TriangleMesh capsule_mesh(const Capsule& capsule) {
  TriangleMesh out = surface_mesh(Ellipsoid{Eigen::Vector3d::Constant(capsule.radius)});
  const auto half = static_cast<float>(capsule.length / 2);
  for (Eigen::Vector3f& v : out.vertices) v.z() += v.z() >= 0 ? half : -half;
  return out;
}

TriangleMesh mesh_of(const Geometry& geometry) {
  return std::visit(
      Overloaded{
          [](const Box& shape) { return box_mesh(shape.size); },
          [](const Cylinder& shape) { return cylinder_mesh(shape); },
          [](const Capsule& shape) { return capsule_mesh(shape); },
          [](const Sphere& shape) {
            return surface_mesh(Ellipsoid{Eigen::Vector3d::Constant(shape.radius)});
          },
          [](const MeshGeometry& shape) { return shape.path.empty() ? TriangleMesh() : load_mesh(shape); },
          [](const Ellipsoid& shape) { return surface_mesh(shape); },
          [](const Cone& shape) { return surface_mesh(shape); },
          [](const Extrusion& shape) { return surface_mesh(shape); },
          [](const Plane&) { return TriangleMesh(); }, [](const Heightmap&) { return TriangleMesh(); }},
      geometry);
}

// Six times the volume; negative: the triangles face inwards.
double volume_of(const TriangleMesh& mesh) {
  double out = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    out += mesh.vertices[a].cast<double>().dot(
        mesh.vertices[b].cast<double>().cross(mesh.vertices[c].cast<double>()));
  return out;
}

// A mesh that cannot be read is a finding of the audit; it leaves the picture without it.
TriangleMesh readable_mesh(const Geometry& geometry) {
  try {
    TriangleMesh out = mesh_of(geometry);
    if (volume_of(out) < 0) {
      for (auto& triangle : out.triangles) std::swap(triangle[1], triangle[2]);
    }
    return out;
  } catch (const InputError&) {
    return {};
  }
}

void append(const TriangleMesh& mesh, const Pose& pose, LinkSurface& out) {
  const auto first = static_cast<std::uint32_t>(out.vertices.size());
  for (const Eigen::Vector3f& v : mesh.vertices)
    out.vertices.emplace_back((pose * v.cast<double>()).cast<float>());
  for (const auto& [a, b, c] : mesh.triangles) out.triangles.push_back({first + a, first + b, first + c});
}

LinkSurface surface_of(const Link& link) {
  LinkSurface out;
  out.name = link.name;
  bool has_colour = false;
  for (const Visual& visual : link.visuals) {
    const TriangleMesh mesh = readable_mesh(visual.geometry);
    append(mesh, visual.origin.pose(), out);
    if (has_colour || mesh.triangles.empty()) continue;
    if (visual.material && visual.material->rgba) {
      out.colour = visual.material->rgba->head<3>().cast<float>();
      has_colour = true;
    } else if (mesh.rgba) {
      out.colour = mesh.rgba->head<3>();
      has_colour = true;
    }
  }
  if (out.triangles.empty()) {
    for (const Collision& collision : link.collisions)
      append(readable_mesh(collision.geometry), collision.origin.pose(), out);
  }
  out.colour = out.colour.cwiseMax(0.0F).cwiseMin(1.0F);
  std::erase_if(out.triangles, [&out](const auto& triangle) {
    return std::ranges::any_of(triangle, [&out](std::uint32_t i) { return !out.vertices[i].allFinite(); });
  });
  return out;
}

struct CellHash {
  std::size_t operator()(const std::array<std::int64_t, 3>& cell) const {
    std::uint64_t out = 1469598103934665603U;
    for (const std::int64_t part : cell) out = (out ^ static_cast<std::uint64_t>(part)) * 1099511628211U;
    return static_cast<std::size_t>(out ^ (out >> 29));
  }
};

// The vertices of each cell of a grid are one, at their mean.
LinkSurface clustered(const LinkSurface& surface, double cell) {
  LinkSurface out;
  out.link = surface.link;
  out.name = surface.name;
  out.colour = surface.colour;
  std::unordered_map<std::array<std::int64_t, 3>, std::uint32_t, CellHash> clusters;
  std::vector<std::uint32_t> cluster_of;
  std::vector<float> counts;
  for (const Eigen::Vector3f& v : surface.vertices) {
    std::array<std::int64_t, 3> key{};
    for (int i = 0; i < 3; ++i)
      key[static_cast<std::size_t>(i)] =
          std::isfinite(v[i]) ? static_cast<std::int64_t>(std::floor(v[i] / cell)) : 0;
    const auto [found, is_new] = clusters.try_emplace(key, static_cast<std::uint32_t>(clusters.size()));
    if (is_new) {
      out.vertices.emplace_back(Eigen::Vector3f::Zero());
      counts.push_back(0);
    }
    if (v.allFinite()) {
      out.vertices[found->second] += v;
      counts[found->second] += 1;
    }
    cluster_of.push_back(found->second);
  }
  for (std::size_t i = 0; i < counts.size(); ++i) out.vertices[i] /= std::max(counts[i], 1.0F);
  for (const auto& [a, b, c] : surface.triangles) {
    std::array<std::uint32_t, 3> one = {cluster_of[a], cluster_of[b], cluster_of[c]};
    if (one[0] == one[1] || one[1] == one[2] || one[2] == one[0]) continue;
    std::rotate(one.begin(), std::min_element(one.begin(), one.end()), one.end());
    out.triangles.push_back(one);
  }
  std::ranges::sort(out.triangles);
  out.triangles.erase(std::unique(out.triangles.begin(), out.triangles.end()), out.triangles.end());
  return out;
}

std::vector<LinkSurface> all_clustered(const std::vector<LinkSurface>& surfaces, double cell) {
  std::vector<LinkSurface> out;
  for (const LinkSurface& surface : surfaces) out.push_back(clustered(surface, cell));
  return out;
}

std::size_t triangle_count(const std::vector<LinkSurface>& surfaces) {
  std::size_t out = 0;
  for (const LinkSurface& surface : surfaces) out += surface.triangles.size();
  return out;
}

double extent_of(const std::vector<LinkSurface>& surfaces) {
  float out = 0;
  for (const LinkSurface& surface : surfaces) {
    for (const Eigen::Vector3f& v : surface.vertices) {
      if (v.allFinite()) out = std::max(out, v.cwiseAbs().maxCoeff());
    }
  }
  return out;
}

}  // namespace

std::vector<LinkSurface> link_surfaces(const RobotDescription& robot, const Model& model) {
  std::vector<LinkSurface> out;
  for (const Link& link : robot.links) {
    LinkSurface surface = surface_of(link);
    surface.link = model.find_link(link.name);
    if (surface.link >= 0 && !surface.triangles.empty()) out.push_back(std::move(surface));
  }
  return out;
}

std::vector<LinkSurface> simplified(const std::vector<LinkSurface>& surfaces, std::size_t triangles) {
  const double extent = extent_of(surfaces);
  if (!(extent > 0)) return surfaces;
  constexpr int kSteps = 12;
  double low = 1e-5 * extent, high = 0.5 * extent;  // cells; at `low`, corners that are one are joined
  std::vector<LinkSurface> best = all_clustered(surfaces, low);
  if (triangle_count(best) <= triangles) return best;
  best = all_clustered(surfaces, high);
  for (int i = 0; i < kSteps; ++i) {
    const double cell = std::sqrt(low * high);
    std::vector<LinkSurface> next = all_clustered(surfaces, cell);
    if (triangle_count(next) <= triangles) {
      high = cell;
      best = std::move(next);
    } else {
      low = cell;
    }
  }
  return best;
}

}  // namespace doppel
