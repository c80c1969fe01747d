#include "doppel/description/meshes/convex_hull.h"

#include <libqhull_r/qhull_ra.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>

namespace doppel {
namespace {

constexpr int kFlatDirections = 50;

// Qhull's state with its memory. Its messages are discarded.
class Qhull {
 public:
  explicit Qhull(std::vector<coordT>& coordinates) {
    qh_zero(&state_, quiet_.get());
    state_.NOerrexit = True;
    char options[] = "qhull Qt Pp FA";
    failed_ = qh_new_qhull(&state_, 3, static_cast<int>(coordinates.size() / 3), coordinates.data(), False,
                           options, nullptr, quiet_.get()) != 0;
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;
  ~Qhull() {
    qh_freeqhull(&state_, !qh_ALL);
    int long_blocks = 0, bytes = 0;
    qh_memfreeshort(&state_, &long_blocks, &bytes);
  }

  [[nodiscard]] bool failed() const { return failed_; }
  qhT* operator->() { return &state_; }
  qhT* get() { return &state_; }

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> quiet_{std::fopen("/dev/null", "w"), &std::fclose};
  qhT state_{};
  bool failed_ = false;
};

// Option Qt gives triangles only; Qhull's normals point outwards, but its corners are in either order.
void collect_triangles(Qhull& hull, const coordT* coordinates, ConvexHull& out) {
  for (const facetT* facet = hull->facet_list; facet != nullptr && facet->next != nullptr;
       facet = facet->next) {
    if (facet->normal == nullptr || facet->vertices == nullptr) continue;
    std::array<std::uint32_t, 3> corners{};
    std::array<Eigen::Vector3d, 3> points;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto* vertex = static_cast<const vertexT*>(facet->vertices->e[i].p);
      if (vertex == nullptr) return;
      corners[i] = static_cast<std::uint32_t>((vertex->point - coordinates) / 3);
      points[i] = Eigen::Map<const Eigen::Vector3d>(vertex->point);
    }
    const Eigen::Vector3d across = (points[1] - points[0]).cross(points[2] - points[0]);
    if (across.dot(Eigen::Map<const Eigen::Vector3d>(facet->normal)) < 0) std::swap(corners[1], corners[2]);
    out.triangles.push_back(corners);
  }
}

}  // namespace

std::vector<Eigen::Vector3d> even_directions(int count) {
  std::vector<Eigen::Vector3d> out;
  out.reserve(static_cast<std::size_t>(count));
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double r = std::sqrt(1.0 - z * z);
    out.emplace_back(r * std::cos(golden * i), r * std::sin(golden * i), z);
  }
  return out;
}

std::vector<std::uint32_t> extreme_points(std::span<const Eigen::Vector3f> points, int directions) {
  std::vector<std::uint32_t> out;
  if (points.empty()) return out;
  const auto furthest = [&](const Eigen::Vector3d& d) {
    const auto along = [&](const Eigen::Vector3f& p) { return p.cast<double>().dot(d); };
    const auto best = std::max_element(points.begin(), points.end(),
                                       [&](const auto& a, const auto& b) { return along(a) < along(b); });
    out.push_back(static_cast<std::uint32_t>(best - points.begin()));
  };
  for (const Eigen::Vector3d& d : even_directions(directions)) furthest(d);
  for (int axis = 0; axis < 3; ++axis) {
    furthest(Eigen::Vector3d::Unit(axis));
    furthest(-Eigen::Vector3d::Unit(axis));
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::vector<Eigen::Vector2d> convex_outline(std::vector<Eigen::Vector2d> points) {
  using Point = Eigen::Vector2d;
  std::ranges::sort(
      points, [](const Point& a, const Point& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  const auto turns_left = [](const Point& a, const Point& b, const Point& c) {
    return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x() > 0;
  };
  std::vector<Point> out;
  for (int side = 0; side < 2 && !points.empty(); ++side) {
    const std::size_t first = out.size();
    for (const Point& p : points) {
      while (out.size() >= first + 2 && !turns_left(out[out.size() - 2], out.back(), p)) out.pop_back();
      out.push_back(p);
    }
    out.pop_back();
    std::ranges::reverse(points);
  }
  return out;
}

ConvexHull convex_hull(std::span<const Eigen::Vector3f> points) {
  ConvexHull out;
  if (points.size() < 4) {
    for (std::uint32_t i = 0; i < points.size(); ++i) out.vertices.push_back(i);
    return out;
  }
  std::vector<coordT> coordinates;
  coordinates.reserve(points.size() * 3);
  for (const Eigen::Vector3f& p : points) {
    for (int i = 0; i < 3; ++i) coordinates.push_back(static_cast<double>(p[i]));
  }
  Qhull hull(coordinates);
  if (hull.failed()) {
    out.vertices = extreme_points(points, kFlatDirections);
    return out;
  }
  for (const vertexT* v = hull->vertex_list; v != nullptr && v->next != nullptr; v = v->next) {
    out.vertices.push_back(static_cast<std::uint32_t>((v->point - coordinates.data()) / 3));
  }
  std::sort(out.vertices.begin(), out.vertices.end());
  qh_getarea(hull.get(), hull->facet_list);
  out.volume = hull->totvol;
  collect_triangles(hull, coordinates.data(), out);
  return out;
}

}  // namespace doppel
