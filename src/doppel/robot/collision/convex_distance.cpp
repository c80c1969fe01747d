// The distance algorithm of convex.h.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "doppel/robot/collision/detail/polytope.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr double kCoresTouch = 1e-10;  // m
constexpr double kMaxGap = 1e-7;       // m; beyond it, the lower bound is the distance
constexpr int kMaxSearchSteps = 200;
constexpr double kHuge = std::numeric_limits<double>::infinity();

// Up to four points of A - B, and the weights of the point of their hull that is nearest to the origin.
struct Simplex {
  std::array<DifferencePoint, 4> points;
  std::array<double, 4> weights{};
  int size = 0;

  void add(const DifferencePoint& point) { points[static_cast<std::size_t>(size++)] = point; }
  [[nodiscard]] bool contains(const Vector3d& p) const {
    return std::any_of(points.begin(), points.begin() + size, [&](const auto& q) { return q.p == p; });
  }
  [[nodiscard]] Vector3d nearest() const {
    Vector3d out = Vector3d::Zero();
    for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) out += weights[i] * points[i].p;
    return out;
  }
  [[nodiscard]] Vector3d nearest_of_a() const {
    Vector3d out = Vector3d::Zero();
    for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) out += weights[i] * points[i].p_A;
    return out;
  }
};

// A face, edge or corner of a simplex with the point that is nearest to the origin.
struct Feature {
  std::array<int, 3> corners{};
  std::array<double, 3> weights{};
  int size = 0;
  double squared = kHuge;  // m^2, distance of the point from the origin
};

void take_nearer(Feature& best, const Feature& other) {
  if (other.squared < best.squared) best = other;
}

Feature nearest_on_edge(const Simplex& s, int i, int j) {
  const Vector3d &a = s.points[static_cast<std::size_t>(i)].p, &b = s.points[static_cast<std::size_t>(j)].p;
  const Vector3d ab = b - a;
  const double length = ab.squaredNorm();
  const double t = length > 0 ? -a.dot(ab) / length : 0.0;
  if (t <= 0) return {{i}, {1}, 1, a.squaredNorm()};
  if (t >= 1) return {{j}, {1}, 1, b.squaredNorm()};
  return {{i, j}, {1 - t, t}, 2, (a + t * ab).squaredNorm()};
}

Feature nearest_on_triangle(const Simplex& s, int i, int j, int k) {
  const Vector3d &a = s.points[static_cast<std::size_t>(i)].p, &b = s.points[static_cast<std::size_t>(j)].p,
                 &c = s.points[static_cast<std::size_t>(k)].p;
  const Vector3d n = (b - a).cross(c - a);
  const double area = n.squaredNorm();
  // The origin's projection is inside if its three partial areas are positive.
  const double of_a = b.cross(c).dot(n), of_b = c.cross(a).dot(n), of_c = a.cross(b).dot(n);
  if (area > 0 && of_a >= 0 && of_b >= 0 && of_c >= 0) {
    const double sum = of_a + of_b + of_c;
    const Vector3d weights(of_a / sum, of_b / sum, of_c / sum);
    const Vector3d p = weights.x() * a + weights.y() * b + weights.z() * c;
    return {{i, j, k}, {weights.x(), weights.y(), weights.z()}, 3, p.squaredNorm()};
  }
  Feature best = nearest_on_edge(s, i, j);
  take_nearer(best, nearest_on_edge(s, j, k));
  take_nearer(best, nearest_on_edge(s, k, i));
  return best;
}

// Whether the origin is on the other side of the face i j k than the corner l, or the four are in one plane.
bool outside(const Simplex& s, int i, int j, int k, int l) {
  const auto point = [&s](int corner) -> const Vector3d& {
    return s.points[static_cast<std::size_t>(corner)].p;
  };
  const Vector3d n = (point(j) - point(i)).cross(point(k) - point(i));
  const double of_corner = n.dot(point(l) - point(i)), of_origin = -n.dot(point(i));
  return of_corner * of_origin <= 0;
}

// Nothing: the origin is inside the four points.
Feature nearest_on_tetrahedron(const Simplex& s) {
  Feature best;
  constexpr std::array<std::array<int, 4>, 4> faces{{{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}}};
  for (const auto& [i, j, k, l] : faces) {
    if (outside(s, i, j, k, l)) take_nearer(best, nearest_on_triangle(s, i, j, k));
  }
  return best;
}

// Reduces the simplex to the feature that is nearest to the origin. False: the origin is inside of it.
bool reduce(Simplex& s) {
  Feature best;
  if (s.size == 1) {
    best = {{0}, {1}, 1, s.points[0].p.squaredNorm()};
  } else if (s.size == 2) {
    best = nearest_on_edge(s, 0, 1);
  } else if (s.size == 3) {
    best = nearest_on_triangle(s, 0, 1, 2);
  } else {
    best = nearest_on_tetrahedron(s);
    if (best.size == 0) return false;
  }
  Simplex out;
  for (std::size_t i = 0; i < static_cast<std::size_t>(best.size); ++i) {
    out.add(s.points[static_cast<std::size_t>(best.corners[i])]);
    out.weights[i] = best.weights[i];
  }
  s = out;
  return true;
}

// The distance of two cores, between two bounds.
struct CoreDistance {
  double lower = -kHuge, upper = kHuge;  // m
  Vector3d separating;                   // unit, from A to B: the direction of the lower bound
  Vector3d normal;                       // unit, from A to B
  Vector3d p_A;                          // m, of A, nearest to B
  [[nodiscard]] bool apart() const { return upper > kCoresTouch; }
};

// Ends as soon as the distance is known to be more than `far` or less than `near`.
CoreDistance core_distance(const SupportDifference& difference, const Vector3d& towards, double near,
                           double far) {
  CoreDistance out;
  Simplex s;
  s.add(difference.support(towards));
  s.weights[0] = 1;
  out.lower = -s.points[0].p.dot(towards);
  out.separating = towards;
  Vector3d v = s.points[0].p;
  out.upper = v.norm();
  out.p_A = s.points[0].p_A;
  for (int step = 0; out.lower <= far && step < kMaxSearchSteps; ++step) {
    if (!out.apart() || out.upper < near) break;
    const Vector3d n = -v / out.upper;
    const DifferencePoint point = difference.support(n);
    if (const double bound = -point.p.dot(n); bound > out.lower) {
      out.lower = bound;
      out.separating = n;
    }
    if (out.lower > far || out.upper - out.lower <= kGap || s.contains(point.p)) break;
    Simplex larger = s;
    larger.add(point);
    if (!reduce(larger)) {
      out.upper = 0;
      break;
    }
    const Vector3d nearer = larger.nearest();
    const double length = nearer.norm();
    if (!(length < out.upper)) break;  // rounding: no point is nearer
    s = larger;
    v = nearer;
    out.upper = length;
    out.p_A = s.nearest_of_a();
  }
  out.normal = out.apart() ? Vector3d(-v / out.upper) : towards;
  return out;
}

Vector3d direction_between(const ConvexSolid& a, const ConvexSolid& b, const Pose& X_AB) {
  const Vector3d way = X_AB * b.centre - a.centre;
  const double length = way.norm();
  return length > 1e-9 ? Vector3d(way / length) : Vector3d::UnitZ();
}

}  // namespace

ConvexDistance convex_distance(const ConvexSolid& a, const ConvexSolid& b, const Pose& X_AB, double far,
                               ConvexWorkspace& memory) {
  const SupportDifference difference{a, b, X_AB};
  const Vector3d towards = direction_between(a, b, X_AB);
  const double rounding = a.rounding + b.rounding;
  const CoreDistance cores = core_distance(difference, towards, -kHuge, far + rounding);
  ConvexDistance out;
  double distance = cores.lower;
  out.normal_A = cores.normal;
  Vector3d p_A = cores.p_A;
  if (cores.lower > far + rounding) {
    // The lower bound is enough.
  } else if (cores.apart()) {
    distance = cores.upper - cores.lower < kMaxGap ? cores.upper : std::max(cores.lower, 0.0);
  } else {
    const PolytopeDepth inside = Polytope(difference, memory).solve(towards, 0.0, true);
    distance = -inside.depth;
    out.normal_A = inside.normal;
    p_A = inside.p_A.value_or(p_A);
  }
  out.p_A = p_A + a.rounding * out.normal_A;
  out.distance = distance - rounding;
  out.p_B = out.p_A + out.distance * out.normal_A;
  return out;
}

std::optional<Vector3d> separating_direction(const ConvexSolid& a, const ConvexSolid& b, const Pose& X_AB) {
  const double rounding = a.rounding + b.rounding;
  const CoreDistance cores = core_distance({a, b, X_AB}, direction_between(a, b, X_AB), rounding, rounding);
  if (!(cores.lower > rounding)) return std::nullopt;
  return cores.separating;
}

bool convex_closer(const ConvexSolid& a, const ConvexSolid& b, const Pose& X_AB, double clearance,
                   ConvexWorkspace& memory) {
  const SupportDifference difference{a, b, X_AB};
  const Vector3d towards = direction_between(a, b, X_AB);
  const double of_cores = clearance + a.rounding + b.rounding;
  const CoreDistance cores = core_distance(difference, towards, of_cores, std::max(of_cores, 0.0));
  if (of_cores > 0) return cores.lower < of_cores;
  if (cores.apart()) return false;
  return Polytope(difference, memory).solve(towards, -of_cores, false).depth > -of_cores;
}

}  // namespace doppel
