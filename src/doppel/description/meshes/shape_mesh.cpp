#include "doppel/description/meshes/shape_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace doppel {
namespace {

constexpr int kRings = 16;  // of an ellipsoid, from pole to pole

using Corners = std::vector<std::uint32_t>;  // of a convex polygon, counter-clockwise

Eigen::Vector2d on_circle(int i) {
  const double angle = 2.0 * std::numbers::pi * i / kRoundCorners;
  return {std::cos(angle), std::sin(angle)};
}

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

double area_of(const std::vector<Eigen::Vector2d>& outline) {
  double twice = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d &p = outline[i], &q = outline[(i + 1) % outline.size()];
    twice += p.x() * q.y() - p.y() * q.x();
  }
  return 0.5 * twice;
}

// Counter-clockwise, without repeated points.
std::vector<Eigen::Vector2d> tidy(const std::vector<Eigen::Vector2d>& outline) {
  std::vector<Eigen::Vector2d> out;
  for (const Eigen::Vector2d& p : outline) {
    if (out.empty() || out.back() != p) out.push_back(p);
  }
  while (out.size() > 1 && out.front() == out.back()) out.pop_back();
  if (area_of(out) < 0) std::reverse(out.begin(), out.end());
  return out;
}

class Decomposition {
 public:
  explicit Decomposition(const std::vector<Eigen::Vector2d>& outline) : points_(outline) {}

  std::vector<Corners> parts() {
    clip_ears();
    for (std::size_t a = 0; a < parts_.size(); ++a) {
      for (std::size_t b = a + 1; b < parts_.size();) {
        if (join(a, b)) {
          parts_.erase(parts_.begin() + static_cast<std::ptrdiff_t>(b));
          b = a + 1;
        } else {
          ++b;
        }
      }
    }
    return parts_;
  }

 private:
  [[nodiscard]] bool ear(const Corners& left, std::size_t i) const {
    const std::size_t n = left.size();
    const auto &a = points_[left[(i + n - 1) % n]], &b = points_[left[i]], &c = points_[left[(i + 1) % n]];
    if (!(turn(a, b, c) > 0)) return false;
    return std::none_of(left.begin(), left.end(), [&](std::uint32_t other) {
      const Eigen::Vector2d& p = points_[other];
      return p != a && p != b && p != c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
    });
  }

  void clip_ears() {
    Corners left(points_.size());
    for (std::size_t i = 0; i < left.size(); ++i) left[i] = static_cast<std::uint32_t>(i);
    bool found = true;
    while (left.size() >= 3 && found) {
      found = false;
      for (std::size_t i = 0; i < left.size() && !found; ++i) {
        if (!ear(left, i)) continue;
        const std::size_t n = left.size();
        parts_.push_back({left[(i + n - 1) % n], left[i], left[(i + 1) % n]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
        found = true;
      }
    }
  }

  [[nodiscard]] bool convex(const Corners& polygon) const {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const std::size_t n = polygon.size();
      if (turn(points_[polygon[i]], points_[polygon[(i + 1) % n]], points_[polygon[(i + 2) % n]]) < 0)
        return false;
    }
    return true;
  }

  // Joins two parts at a common edge if the result is convex.
  bool join(std::size_t a, std::size_t b) {
    Corners &p = parts_[a], &q = parts_[b];
    for (std::size_t i = 0; i < p.size(); ++i) {
      for (std::size_t j = 0; j < q.size(); ++j) {
        const std::size_t i2 = (i + 1) % p.size(), j2 = (j + 1) % q.size();
        if (p[i] != q[j2] || p[i2] != q[j]) continue;
        Corners both;
        for (std::size_t k = 0; k < p.size(); ++k) both.push_back(p[(i2 + k) % p.size()]);  // ends at p[i]
        for (std::size_t k = 1; k + 1 < q.size(); ++k) both.push_back(q[(j2 + k) % q.size()]);
        if (!convex(both)) return false;
        p = std::move(both);
        return true;
      }
    }
    return false;
  }

  const std::vector<Eigen::Vector2d>& points_;
  std::vector<Corners> parts_;
};

}  // namespace

TriangleMesh surface_mesh(const Ellipsoid& ellipsoid) {
  TriangleMesh out;
  const auto add = [&](double x, double y, double z) {
    out.vertices.push_back(Eigen::Vector3d(x, y, z).cwiseProduct(ellipsoid.radii).cast<float>());
  };
  add(0, 0, 1);
  for (int ring = 1; ring < kRings; ++ring) {
    const double polar = std::numbers::pi * ring / kRings;
    for (int i = 0; i < kRoundCorners; ++i) {
      const Eigen::Vector2d at = std::sin(polar) * on_circle(i);
      add(at.x(), at.y(), std::cos(polar));
    }
  }
  add(0, 0, -1);
  const auto last = static_cast<std::uint32_t>(out.vertices.size() - 1);
  for (std::uint32_t i = 0; i < kRoundCorners; ++i) {
    const std::uint32_t next = (i + 1) % kRoundCorners;
    out.triangles.push_back({0, 1 + i, 1 + next});
    for (std::uint32_t ring = 0; ring + 2 < kRings; ++ring) {
      const std::uint32_t upper = 1 + ring * kRoundCorners, lower = upper + kRoundCorners;
      out.triangles.push_back({upper + i, lower + i, lower + next});
      out.triangles.push_back({upper + i, lower + next, upper + next});
    }
    out.triangles.push_back({last, last - kRoundCorners + next, last - kRoundCorners + i});
  }
  return out;
}

TriangleMesh surface_mesh(const Cone& cone) {
  TriangleMesh out;
  for (int i = 0; i < kRoundCorners; ++i) {
    const Eigen::Vector2d at = cone.radius * on_circle(i);
    out.vertices.push_back(Eigen::Vector3d(at.x(), at.y(), -cone.length / 2).cast<float>());
  }
  out.vertices.push_back(Eigen::Vector3d(0, 0, cone.length / 2).cast<float>());
  for (std::uint32_t i = 0; i < kRoundCorners; ++i) {
    const std::uint32_t next = (i + 1) % kRoundCorners;
    out.triangles.push_back({i, next, kRoundCorners});
    if (i > 0 && next > 0) out.triangles.push_back({0, next, i});
  }
  return out;
}

TriangleMesh surface_mesh(const Extrusion& extrusion) {
  TriangleMesh out;
  for (const double z : {0.0, extrusion.height}) {
    for (const Eigen::Vector2d& p : extrusion.outline)
      out.vertices.push_back(Eigen::Vector3d(p.x(), p.y(), z).cast<float>());
  }
  const auto n = static_cast<std::uint32_t>(extrusion.outline.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    out.triangles.push_back({i, next, n + next});
    out.triangles.push_back({i, n + next, n + i});
    if (i == 0 || next == 0) continue;
    out.triangles.push_back({0, next, i});
    out.triangles.push_back({n, n + i, n + next});
  }
  return out;
}

std::optional<TriangleMesh> convex_surface(const Geometry& geometry) {
  return std::visit(
      [](const auto& shape) -> std::optional<TriangleMesh> {
        if constexpr (requires { surface_mesh(shape); }) return surface_mesh(shape);
        return std::nullopt;
      },
      geometry);
}

std::vector<std::vector<Eigen::Vector2d>> convex_parts(const std::vector<Eigen::Vector2d>& outline) {
  const std::vector<Eigen::Vector2d> points = tidy(outline);
  std::vector<std::vector<Eigen::Vector2d>> out;
  if (points.size() < 3 || !(area_of(points) > 0)) return out;
  for (const Corners& part : Decomposition(points).parts()) {
    std::vector<Eigen::Vector2d> polygon;
    for (const std::uint32_t corner : part) polygon.push_back(points[corner]);
    out.push_back(std::move(polygon));
  }
  return out;
}

}  // namespace doppel
