#include "doppel/description/meshes/texture_coordinates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace doppel {
namespace {

using TriangleCorners = std::array<Eigen::Vector3f, 3>;

bool is_level(const TriangleCorners& p) {
  const Eigen::Vector3f n = (p[1] - p[0]).cross(p[2] - p[0]);
  return n.head<2>().norm() < 1e-3F * n.norm();
}

void add_level(const TriangleCorners& p, float unit, std::vector<Eigen::Vector2f>& out) {
  for (const Eigen::Vector3f& corner : p) out.emplace_back(corner.head<2>() / unit);
}

// The tip has the angle of the middle of its triangle, and no corner is on the other side of the seam.
void add_side(const TriangleCorners& p, const Cone& cone, std::vector<Eigen::Vector2f>& out) {
  const Eigen::Vector3f middle = (p[0] + p[1] + p[2]) / 3;
  const float centre = std::atan2(middle.y(), middle.x());
  for (const Eigen::Vector3f& corner : p) {
    const bool tip = corner.head<2>().norm() < 1e-6 * cone.radius;
    const float angle = tip ? centre : std::atan2(corner.y(), corner.x());
    const float turn = 2 * std::numbers::pi_v<float>;
    const float around = centre + std::remainder(angle - centre, turn);
    out.emplace_back(around / turn, corner.z() / static_cast<float>(cone.length) + 0.5F);
  }
}

// The distance of a corner of the extrusion along the outline, m.
float along_outline(const Extrusion& shape, const Eigen::Vector3f& corner) {
  double length = 0;
  const std::size_t n = shape.outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    if ((shape.outline[i] - corner.head<2>().cast<double>()).norm() < 1e-5) break;
    length += (shape.outline[(i + 1) % n] - shape.outline[i]).norm();
  }
  return static_cast<float>(length);
}

void add_side(const TriangleCorners& p, const Extrusion& shape, std::vector<Eigen::Vector2f>& out) {
  std::array<float, 3> u{};
  for (std::size_t i = 0; i < 3; ++i) u[i] = along_outline(shape, p[i]);
  const auto [low, high] = std::ranges::minmax(u);
  double around = 0;
  for (std::size_t i = 0; i < shape.outline.size(); ++i)
    around += (shape.outline[(i + 1) % shape.outline.size()] - shape.outline[i]).norm();
  // The side that closes the outline begins at its last corner.
  const double last = around - (shape.outline.front() - shape.outline.back()).norm();
  const bool closes = low == 0.0F && std::abs(high - last) < 1e-4 && shape.outline.size() > 2;
  for (std::size_t i = 0; i < 3; ++i)
    out.emplace_back(closes && u[i] == 0.0F ? static_cast<float>(around) : u[i], p[i].z());
}

}  // namespace

std::vector<Eigen::Vector2f> texture_coordinates(const Geometry& geometry, const TriangleMesh& surface) {
  std::vector<Eigen::Vector2f> out;
  const auto* cone = std::get_if<Cone>(&geometry);
  const auto* extrusion = std::get_if<Extrusion>(&geometry);
  if (cone == nullptr && extrusion == nullptr) return out;
  for (const auto& t : surface.triangles) {
    const TriangleCorners p{surface.vertices[t[0]], surface.vertices[t[1]], surface.vertices[t[2]]};
    if (is_level(p)) {
      add_level(p, 1.0F, out);
    } else if (cone != nullptr) {
      add_side(p, *cone, out);
    } else {
      add_side(p, *extrusion, out);
    }
  }
  return out;
}

}  // namespace doppel
