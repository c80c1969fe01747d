#include <Eigen/Geometry>

#include "doppel/description/meshes/detail/mesh.h"

namespace doppel::mesh {
namespace {

using Point = Eigen::Vector2f;

float cross(const Point& a, const Point& b, const Point& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

bool inside(const Point& a, const Point& b, const Point& c, const Point& p) {
  return cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0;
}

// The polygon in the plane where it is largest, counter-clockwise.
std::vector<Point> flattened(const TriangleSoup& soup, const std::vector<std::uint32_t>& corners) {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // Newell's
  for (std::size_t i = 0; i < corners.size(); ++i) {
    normal += soup.points[corners[i]].cross(soup.points[corners[(i + 1) % corners.size()]]);
  }
  int drop = 0;
  normal.cwiseAbs().maxCoeff(&drop);
  const int x = (drop + 1) % 3, y = (drop + 2) % 3;
  std::vector<Point> out;
  for (const std::uint32_t corner : corners) {
    Point p(soup.points[corner][x], soup.points[corner][y]);
    if (normal[drop] < 0) p.x() = -p.x();
    out.push_back(p);
  }
  return out;
}

bool is_ear(const std::vector<Point>& points, const std::vector<std::size_t>& left, std::size_t i,
            std::size_t& tests) {
  ++tests;
  const std::size_t n = left.size(), before = left[(i + n - 1) % n], at = left[i], after = left[(i + 1) % n];
  if (!(cross(points[before], points[at], points[after]) > 0)) return false;
  for (const std::size_t other : left) {
    ++tests;
    if (other == before || other == at || other == after) continue;
    if (inside(points[before], points[at], points[after], points[other])) return false;
  }
  return true;
}

void add_fan(TriangleSoup& soup, const std::vector<std::uint32_t>& corners,
             const std::vector<std::size_t>& left) {
  for (std::size_t i = 2; i < left.size(); ++i)
    soup.triangles.push_back({corners[left[0]], corners[left[i - 1]], corners[left[i]]});
}

}  // namespace

void add_polygon(TriangleSoup& soup, const std::vector<std::uint32_t>& corners) {
  std::vector<std::size_t> left(corners.size());
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = i;
  if (corners.size() > 3 && corners.size() <= kMaxPolygonCorners) {
    const std::vector<Point> points = flattened(soup, corners);
    bool found = true;
    while (left.size() > 3 && found && soup.ear_tests < kMaxEarTests) {
      found = false;
      for (std::size_t i = 0; i < left.size(); ++i) {
        if (!is_ear(points, left, i, soup.ear_tests)) continue;
        const std::size_t n = left.size();
        soup.triangles.push_back(
            {corners[left[(i + n - 1) % n]], corners[left[i]], corners[left[(i + 1) % n]]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
        found = true;
        break;
      }
    }
  }
  add_fan(soup, corners, left);
}

}  // namespace doppel::mesh
