#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

float corner_angle(const Eigen::Vector3f& at, const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  const Eigen::Vector3f to_a = a - at, to_b = b - at;
  return std::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b));
}

// The corners (3 * triangle + k) at each point, one list behind the other.
struct CornersAtPoints {
  std::vector<std::uint32_t> first, corners;  // of point p: corners[first[p]] to corners[first[p + 1]]
};

CornersAtPoints corners_at_points(std::size_t points,
                                  const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  CornersAtPoints out;
  out.first.assign(points + 1, 0);
  for (const auto& t : triangles)
    for (const std::uint32_t p : t) ++out.first[p + 1];
  std::partial_sum(out.first.begin(), out.first.end(), out.first.begin());
  std::vector<std::uint32_t> next(out.first.begin(), out.first.end() - 1);
  out.corners.resize(triangles.size() * 3);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      out.corners[next[triangles[i][k]]++] = static_cast<std::uint32_t>(3 * i + k);
  return out;
}

}  // namespace

Eigen::Vector3f unit_or_up(const Eigen::Vector3f& normal) {
  const Eigen::Vector3d wide = normal.cast<double>();  // whose square does not overflow
  const double length = wide.norm();
  if (!std::isfinite(length) || length == 0) return Eigen::Vector3f::UnitZ();
  return (wide / length).cast<float>();
}

SurfaceMesh with_normals(const std::vector<Eigen::Vector3f>& points,
                         const std::vector<std::array<std::uint32_t, 3>>& triangles, double crease) {
  std::vector<Eigen::Vector3f> faces;
  std::vector<float> angles;
  for (const auto& t : triangles) {
    faces.push_back((points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).normalized());
    for (std::size_t k = 0; k < 3; ++k)
      angles.push_back(corner_angle(points[t[k]], points[t[(k + 1) % 3]], points[t[(k + 2) % 3]]));
  }
  const CornersAtPoints around = corners_at_points(points.size(), triangles);
  const auto limit = static_cast<float>(std::cos(crease));
  SurfaceMesh out;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const auto base = static_cast<std::uint32_t>(out.positions.size());
    for (const std::uint32_t p : triangles[i]) {
      Eigen::Vector3f normal = Eigen::Vector3f::Zero();
      for (std::uint32_t c = around.first[p]; c < around.first[p + 1]; ++c) {
        const std::uint32_t corner = around.corners[c];
        if (faces[corner / 3].dot(faces[i]) >= limit) normal += angles[corner] * faces[corner / 3];
      }
      out.positions.push_back(points[p]);
      out.normals.push_back(unit_or_up(normal.squaredNorm() > 0 ? normal : faces[i]));
    }
    out.triangles.push_back({base, base + 1, base + 2});
  }
  out.parts.push_back({0, static_cast<std::uint32_t>(out.triangles.size()), -1});
  return out;
}

}  // namespace doppel
