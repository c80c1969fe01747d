#include "doppel/robot/clearance/detail/triangle_tree.h"

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kLeafTriangles = 2;

// The squared distance of the segments p q and r s. Source: Ericson, section 5.1.9.
double squared_segment_distance(const Vector3d& p, const Vector3d& q, const Vector3d& r, const Vector3d& s) {
  const Vector3d d1 = q - p, d2 = s - r, w = p - r;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(w), c = d1.dot(w), b = d1.dot(d2);
  constexpr double kPoint = 1e-24;
  double along1 = 0, along2 = 0;
  if (a > kPoint && e > kPoint) {
    const double denominator = a * e - b * b;
    if (denominator > 0) along1 = std::clamp((b * f - c * e) / denominator, 0.0, 1.0);
    along2 = (b * along1 + f) / e;
    if (along2 < 0) {
      along2 = 0;
      along1 = std::clamp(-c / a, 0.0, 1.0);
    } else if (along2 > 1) {
      along2 = 1;
      along1 = std::clamp((b - c) / a, 0.0, 1.0);
    }
  } else if (a > kPoint) {
    along1 = std::clamp(-c / a, 0.0, 1.0);
  } else if (e > kPoint) {
    along2 = std::clamp(f / e, 0.0, 1.0);
  }
  return (p + along1 * d1 - r - along2 * d2).squaredNorm();
}

// True if the segment crosses the triangle; a segment that only just does is found by the distances of
// edges and corners.
bool pierces(const Vector3d& p, const Vector3d& q, const Triangle3& t) {
  const Vector3d u = t.b - t.a, v = t.c - t.a, normal = u.cross(v);
  const double at_p = normal.dot(p - t.a), at_q = normal.dot(q - t.a);
  if ((at_p > 0) == (at_q > 0) || at_p == at_q) return false;
  const Vector3d x = p + (q - p) * (at_p / (at_p - at_q));
  const auto beside = [&](const Vector3d& begin, const Vector3d& end) {
    return (end - begin).cross(x - begin).dot(normal) < 0;
  };
  return !beside(t.a, t.b) && !beside(t.b, t.c) && !beside(t.c, t.a);
}

// True if two triangles are at least `distance` apart along `axis`, of any length.
bool apart_along(const Vector3d& axis, const Triangle3& s, const Triangle3& t, double distance) {
  const double a = axis.dot(s.a), b = axis.dot(s.b), c = axis.dot(s.c);
  const double d = axis.dot(t.a), e = axis.dot(t.b), f = axis.dot(t.c);
  const double gap =
      std::max(std::min({d, e, f}) - std::max({a, b, c}), std::min({a, b, c}) - std::max({d, e, f}));
  return gap > 0 && gap * gap >= distance * distance * axis.squaredNorm();
}

// True for most of the pairs that are farther apart than that: by their planes or between their middles.
bool surely_apart(const Triangle3& s, const Triangle3& t, double distance) {
  return apart_along((s.b - s.a).cross(s.c - s.a), s, t, distance) ||
         apart_along((t.b - t.a).cross(t.c - t.a), s, t, distance) ||
         apart_along(t.a + t.b + t.c - s.a - s.b - s.c, s, t, distance);
}

Triangle3 placed_triangle(const Pose& X, const Triangle3& t) {
  return {X * t.a, X * t.b, X * t.c};
}

// m from p, at least 0.
double box_distance(const Vector3d& centre, const Vector3d& half, const Vector3d& p) {
  return ((p - centre).cwiseAbs() - half).cwiseMax(0.0).norm();
}

}  // namespace

Vector3d nearest_point(const Triangle3& t, const Vector3d& p) {
  const Vector3d ab = t.b - t.a, ac = t.c - t.a, ap = p - t.a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return t.a;
  const Vector3d bp = p - t.b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return t.b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return t.a + ab * (d1 / (d1 - d3));
  const Vector3d cp = p - t.c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return t.c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return t.a + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return t.b + (t.c - t.b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const double sum = va + vb + vc;
  return t.a + ab * (vb / sum) + ac * (vc / sum);
}

double triangle_distance(const Triangle3& first, const Triangle3& second) {
  const std::array<const Vector3d*, 4> p{&first.a, &first.b, &first.c, &first.a};
  const std::array<const Vector3d*, 4> r{&second.a, &second.b, &second.c, &second.a};
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      nearest = std::min(nearest, squared_segment_distance(*p[i], *p[i + 1], *r[k], *r[k + 1]));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (pierces(*p[i], *p[i + 1], second) || pierces(*r[i], *r[i + 1], first)) return 0;
    nearest = std::min(nearest, (nearest_point(second, *p[i]) - *p[i]).squaredNorm());
    nearest = std::min(nearest, (nearest_point(first, *r[i]) - *r[i]).squaredNorm());
  }
  return std::sqrt(nearest);
}

double longest_side(const Triangle3& t) {
  return std::sqrt(
      std::max({(t.b - t.a).squaredNorm(), (t.c - t.b).squaredNorm(), (t.a - t.c).squaredNorm()}));
}

std::array<Triangle3, 2> halves(const Triangle3& t) {
  const double ab = (t.b - t.a).squaredNorm(), bc = (t.c - t.b).squaredNorm(), ca = (t.a - t.c).squaredNorm();
  const bool first = ab >= bc && ab >= ca, second = !first && bc >= ca;
  const Vector3d &p = first    ? t.a
                      : second ? t.b
                               : t.c,
                 &q = first    ? t.b
                      : second ? t.c
                               : t.a,
                 &r = first    ? t.c
                      : second ? t.a
                               : t.b;
  const Vector3d middle = (p + q) / 2;
  return {Triangle3{p, middle, r}, Triangle3{middle, q, r}};
}

TriangleTree::TriangleTree(std::vector<Triangle3> triangles) : triangles_(std::move(triangles)) {
  if (triangles_.empty()) return;
  nodes_.reserve(triangles_.size());
  nodes_.emplace_back();
  build(0, 0, static_cast<std::uint32_t>(triangles_.size()));
}

void TriangleTree::build(std::uint32_t node, std::uint32_t first, std::uint32_t count) {
  Eigen::AlignedBox3d box, centres;
  const auto begin = triangles_.begin() + first, end = begin + count;
  for (auto t = begin; t != end; ++t) {
    box.extend(t->a).extend(t->b).extend(t->c);
    centres.extend(Vector3d((t->a + t->b + t->c) / 3));
  }
  nodes_[node].centre = box.center();
  nodes_[node].half = box.sizes() / 2;
  nodes_[node].radius = nodes_[node].half.norm();
  if (count <= kLeafTriangles) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const std::uint32_t half = count / 2;
  std::nth_element(begin, begin + half, end, [axis](const Triangle3& s, const Triangle3& t) {
    return s.a[axis] + s.b[axis] + s.c[axis] < t.a[axis] + t.b[axis] + t.c[axis];
  });
  const auto child = static_cast<std::uint32_t>(nodes_.size());
  nodes_[node].first = child;
  nodes_.emplace_back();
  nodes_.emplace_back();
  build(child, first, half);
  build(child + 1, first + half, count - half);
}

double TriangleTree::distance(const Vector3d& p, double far) const {
  if (empty()) return far;
  std::array<std::uint32_t, 64> stack{};
  std::size_t waiting = 1;
  double nearest = far;
  while (waiting > 0) {
    const Node& node = nodes_[stack[--waiting]];
    if (box_distance(node.centre, node.half, p) >= nearest) continue;
    for (std::uint32_t i = 0; i < node.count; ++i)
      nearest = std::min(nearest, (nearest_point(triangles_[node.first + i], p) - p).norm());
    if (node.count > 0) continue;
    // The nearer child is on top.
    const Node &left = nodes_[node.first], &right = nodes_[node.first + 1];
    const bool left_first = (left.centre - p).squaredNorm() < (right.centre - p).squaredNorm();
    stack[waiting++] = node.first + (left_first ? 1 : 0);
    stack[waiting++] = node.first + (left_first ? 0 : 1);
  }
  return nearest;
}

double TriangleTree::distance(const TriangleTree& other, const Pose& X_TO, double far, double enough) const {
  if (empty() || other.empty()) return far;
  const Eigen::Matrix3d R = X_TO.linear(), sizes = R.cwiseAbs();
  struct Task {
    std::uint32_t mine, theirs;
  };
  std::array<Task, 256> stack{};
  std::size_t waiting = 1;
  double nearest = far;
  while (waiting > 0) {
    const Task task = stack[--waiting];
    const Node &m = nodes_[task.mine], &t = other.nodes_[task.theirs];
    const Vector3d centre = X_TO * t.centre;
    // The boxes are apart by no less along the axes of the one or of the other.
    const Vector3d between = m.centre - centre;
    const double bound = std::max((between.cwiseAbs() - m.half - sizes * t.half).cwiseMax(0.0).squaredNorm(),
                                  ((R.transpose() * between).cwiseAbs() - t.half - sizes.transpose() * m.half)
                                      .cwiseMax(0.0)
                                      .squaredNorm());
    if (bound >= nearest * nearest) continue;
    if (nearest <= enough) break;
    if (m.count > 0 && t.count > 0) {
      for (std::uint32_t k = 0; k < t.count; ++k) {
        const Triangle3 moved = placed_triangle(X_TO, other.triangles_[t.first + k]);
        for (std::uint32_t i = 0; i < m.count; ++i) {
          const Triangle3& mine = triangles_[m.first + i];
          if (!surely_apart(mine, moved, nearest))
            nearest = std::min(nearest, triangle_distance(mine, moved));
        }
      }
      continue;
    }
    if (t.count > 0 || (m.count == 0 && m.radius >= t.radius)) {
      const bool second_nearer = (nodes_[m.first + 1].centre - centre).squaredNorm() <
                                 (nodes_[m.first].centre - centre).squaredNorm();
      stack[waiting++] = {m.first + (second_nearer ? 0 : 1), task.theirs};
      stack[waiting++] = {m.first + (second_nearer ? 1 : 0), task.theirs};
    } else {
      const Vector3d mine = X_TO.inverse(Eigen::Isometry) * m.centre;
      const bool second_nearer = (other.nodes_[t.first + 1].centre - mine).squaredNorm() <
                                 (other.nodes_[t.first].centre - mine).squaredNorm();
      stack[waiting++] = {task.mine, t.first + (second_nearer ? 0 : 1)};
      stack[waiting++] = {task.mine, t.first + (second_nearer ? 1 : 0)};
    }
  }
  return nearest;
}

int TriangleTree::crossings(const Vector3d& p, const Vector3d& direction) const {
  if (empty()) return 0;
  const double reach = (nodes_[0].centre - p).norm() + nodes_[0].radius + 1;
  const Vector3d end = p + direction.normalized() * reach;
  const Vector3d middle = (p + end) / 2, half = (end - p).cwiseAbs() / 2;
  std::array<std::uint32_t, 64> stack{};
  std::size_t waiting = 1;
  int found = 0;
  while (waiting > 0) {
    const Node& node = nodes_[stack[--waiting]];
    if (((node.centre - middle).cwiseAbs() - half - node.half).maxCoeff() > 0) continue;
    if ((node.centre - p).cross(direction).norm() > node.radius * direction.norm()) continue;
    for (std::uint32_t i = 0; i < node.count; ++i)
      found += pierces(p, end, triangles_[node.first + i]) ? 1 : 0;
    if (node.count > 0) continue;
    stack[waiting++] = node.first;
    stack[waiting++] = node.first + 1;
  }
  return found;
}

}  // namespace doppel
