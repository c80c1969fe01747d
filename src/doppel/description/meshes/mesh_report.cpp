#include "doppel/description/meshes/mesh_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/meshes/convex_hull.h"
#include "doppel/description/meshes/mesh.h"

namespace doppel {
namespace {

constexpr double kNoArea = 1e-10;  // of the bounds' diagonal squared

struct DirectedEdge {
  std::uint64_t ends = 0;  // the smaller index first
  bool forward = false;
};

void count_edges(const TriangleMesh& mesh, MeshReport& out) {
  std::vector<DirectedEdge> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t a = t[i], b = t[(i + 1) % 3];
      edges.push_back({std::min(a, b) << 32 | std::max(a, b), a < b});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const DirectedEdge& a, const DirectedEdge& b) { return a.ends < b.ends; });
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t count = 0, forward = 0;
    for (; i + count < edges.size() && edges[i + count].ends == edges[i].ends; ++count) {
      forward += edges[i + count].forward ? 1 : 0;
    }
    if (count == 1)
      ++out.open_edges;
    else if (2 * forward != count)
      ++out.crossed_edges;
    i += count;
  }
}

void measure_triangles(const TriangleMesh& mesh, MeshReport& out) {
  const double no_area = kNoArea * (out.upper - out.lower).squaredNorm();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[t[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices[t[2]].cast<double>();
    const double area = 0.5 * (b - a).cross(c - a).norm();
    out.area += area;
    if (area <= no_area) ++out.degenerate;
  }
}

void find_hull(const TriangleMesh& mesh, MeshReport& out) {
  std::vector<Eigen::Vector3f> corners;
  ConvexHull hull = convex_hull(mesh.vertices);
  for (const std::uint32_t i : hull.vertices) corners.push_back(mesh.vertices[i]);
  if (corners.size() > kHullVertices) {
    std::vector<Eigen::Vector3f> kept;
    for (const std::uint32_t i : extreme_points(corners, static_cast<int>(kHullVertices) - 6)) {
      kept.push_back(corners[i]);
    }
    corners = std::move(kept);
  }
  out.hull = std::move(corners);
  out.hull_volume = hull.volume;
}

}  // namespace

MeshReport report_mesh(const std::filesystem::path& file) {
  MeshReport out;
  std::error_code failed;
  if (const auto size = std::filesystem::file_size(file, failed); !failed && size > kMaxMeasuredBytes) {
    out.problem = fmt::format("it is larger than {} MB and was not measured", kMaxMeasuredBytes >> 20);
    out.rule = "audit.skipped";
    return out;
  }
  try {
    const TriangleMesh mesh = load_mesh(file.string(), Eigen::Vector3d::Ones());
    const bool finite = std::all_of(mesh.vertices.begin(), mesh.vertices.end(),
                                    [](const Eigen::Vector3f& v) { return v.allFinite(); });
    if (!finite) {
      out.rule = "mesh.unreadable";
      out.problem = "the mesh has vertices with positions that are not finite";
      return out;
    }
    out.remark = mesh.remark;
    out.vertices = mesh.vertices.size();
    out.triangles = mesh.triangles.size();
    const Eigen::AlignedBox3f bounds = mesh.bounds();
    out.lower = bounds.min().cast<double>();
    out.upper = bounds.max().cast<double>();
    out.solid = solid_properties(mesh.vertices, mesh.triangles);
    measure_triangles(mesh, out);
    count_edges(mesh, out);
    find_hull(mesh, out);
  } catch (const InputError& error) {
    out.problem = error.diagnostics().front().message;
    out.rule = error.diagnostics().front().rule;
  } catch (const std::exception& error) {
    out.problem = fmt::format("the mesh cannot be read: {}", error.what());
    out.rule = "mesh.unreadable";
  }
  return out;
}

}  // namespace doppel
