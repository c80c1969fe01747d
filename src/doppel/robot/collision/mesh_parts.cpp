#include "doppel/robot/collision/detail/mesh_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace doppel {
namespace {

constexpr double kPlanar = 1e-4;        // of the surface's extent
constexpr double kThinnestPart = 2e-3;  // of the triangle's extent: MuJoCo rejects thinner ones
constexpr double kSliver = 2e-3;        // m, of a triangle's height: lower ones are left out
constexpr std::size_t kMaxConvexTests = 5'000'000;

using Triangle = std::array<std::uint32_t, 3>;

struct Surface {
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> vertices;
};

std::vector<Surface> connected_surfaces(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> up(mesh.vertices.size());
  std::iota(up.begin(), up.end(), 0u);
  const auto root = [&up](std::uint32_t v) {
    while (up[v] != v) v = up[v] = up[up[v]];
    return v;
  };
  for (const Triangle& t : mesh.triangles) {
    up[root(t[1])] = root(t[0]);
    up[root(t[2])] = root(t[0]);
  }
  std::map<std::uint32_t, std::size_t> index;
  std::vector<Surface> out;
  for (const Triangle& t : mesh.triangles) {
    const auto [at, fresh] = index.emplace(root(t[0]), out.size());
    if (fresh) out.emplace_back();
    Surface& surface = out[at->second];
    surface.triangles.push_back(t);
    surface.vertices.insert(surface.vertices.end(), t.begin(), t.end());
  }
  for (Surface& surface : out) {
    std::sort(surface.vertices.begin(), surface.vertices.end());
    surface.vertices.erase(std::unique(surface.vertices.begin(), surface.vertices.end()),
                           surface.vertices.end());
  }
  return out;
}

Eigen::Vector3d corner(const TriangleMesh& mesh, std::uint32_t vertex) {
  return mesh.vertices[vertex].cast<double>();
}

Eigen::Vector3d normal_of(const TriangleMesh& mesh, const Triangle& t) {
  const Eigen::Vector3d a = corner(mesh, t[0]);
  return (corner(mesh, t[1]) - a).cross(corner(mesh, t[2]) - a);
}

struct Convexity {
  bool convex = false;  // all vertices are on one side of the plane of every triangle
  double extent = 0,
         thickness = std::numeric_limits<double>::infinity();  // m; the least along a triangle's normal
  Eigen::Vector3d across = Eigen::Vector3d::UnitZ();           // that normal, unit
};

Convexity convexity(const TriangleMesh& mesh, const Surface& surface) {
  Convexity out;
  if (surface.triangles.size() * surface.vertices.size() > kMaxConvexTests) return out;
  Eigen::AlignedBox3d bounds;
  for (const std::uint32_t v : surface.vertices) bounds.extend(corner(mesh, v));
  out.extent = bounds.sizes().norm();
  const double slack = kPlanar * out.extent;
  for (const Triangle& t : surface.triangles) {
    const Eigen::Vector3d normal = normal_of(mesh, t);
    if (!(normal.norm() > 0)) continue;
    const Eigen::Vector3d n = normal.normalized(), at = corner(mesh, t[0]);
    double low = 0, high = 0;
    for (const std::uint32_t v : surface.vertices) {
      const double height = n.dot(corner(mesh, v) - at);
      low = std::min(low, height);
      high = std::max(high, height);
    }
    if (high > slack && low < -slack) return out;
    if (high - low >= out.thickness) continue;
    out.thickness = high - low;
    out.across = n;
  }
  out.convex = std::isfinite(out.thickness);
  return out;
}

// The vertices; of a thin surface once more, so far inwards that engines accept the hull.
std::vector<Eigen::Vector3f> solid_part(const TriangleMesh& mesh, const Surface& surface,
                                        const Convexity& is) {
  std::vector<Eigen::Vector3f> out;
  const double least = kThinnestPart * is.extent;
  for (const std::uint32_t v : surface.vertices) {
    out.push_back(mesh.vertices[v]);
    if (is.convex && is.thickness < least)
      out.push_back((corner(mesh, v) - std::max(kShellThickness, least) * is.across).cast<float>());
  }
  return out;
}

std::vector<Eigen::Vector3f> prism(const TriangleMesh& mesh, const Triangle& t) {
  const Eigen::Vector3d normal = normal_of(mesh, t);
  double extent = 0;
  for (int i = 0; i < 3; ++i)
    extent = std::max(extent, (corner(mesh, t[i]) - corner(mesh, t[(i + 1) % 3])).norm());
  if (!(normal.norm() > kSliver * extent)) return {};
  const Eigen::Vector3d inwards = -std::max(kShellThickness, kThinnestPart * extent) * normal.normalized();
  std::vector<Eigen::Vector3f> out;
  for (const std::uint32_t v : t) {
    out.push_back(mesh.vertices[v]);
    out.push_back((corner(mesh, v) + inwards).cast<float>());
  }
  return out;
}

}  // namespace

MeshParts static_parts(const TriangleMesh& mesh) {
  MeshParts out;
  std::size_t shells = 0;
  for (const Surface& surface : connected_surfaces(mesh)) {
    const Convexity is = convexity(mesh, surface);
    if (!is.convex && shells + surface.triangles.size() <= kMaxShellTriangles) {
      shells += surface.triangles.size();
      for (const Triangle& t : surface.triangles) {
        if (std::vector<Eigen::Vector3f> part = prism(mesh, t); !part.empty())
          out.parts.push_back(std::move(part));
      }
      continue;
    }
    out.filled += is.convex ? 0 : 1;
    out.parts.push_back(solid_part(mesh, surface, is));
  }
  return out;
}

MeshParts moving_parts(const TriangleMesh& mesh) {
  MeshParts out;
  const std::vector<Surface> surfaces = connected_surfaces(mesh);
  if (surfaces.size() > kMaxMovingParts) {
    out.parts.push_back(mesh.vertices);
    out.joined = surfaces.size();
    return out;
  }
  for (const Surface& surface : surfaces) {
    const Convexity is = convexity(mesh, surface);
    out.filled += is.convex ? 0 : 1;
    out.parts.push_back(solid_part(mesh, surface, is));
  }
  return out;
}

}  // namespace doppel
