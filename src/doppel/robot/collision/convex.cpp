#include "doppel/robot/collision/detail/convex.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace doppel {
namespace {

using Eigen::Vector3d;

Vector3d support(const Box& box, const Vector3d& d) {
  return 0.5 * box.size.cwiseProduct(d.unaryExpr([](double x) { return x < 0 ? -1.0 : 1.0; }));
}

Vector3d support(const Cylinder& cylinder, const Vector3d& d) {
  const double across = d.head<2>().norm(), half = d.z() < 0 ? -0.5 : 0.5;
  Vector3d point(0, 0, half * cylinder.length);
  if (across > 0) point.head<2>() = d.head<2>() * (cylinder.radius / across);
  return point;
}

Vector3d support(const Capsule& capsule, const Vector3d& d) {
  return d.normalized() * capsule.radius + Vector3d(0, 0, (d.z() < 0 ? -0.5 : 0.5) * capsule.length);
}

Vector3d support(const Sphere& sphere, const Vector3d& d) {
  return d.normalized() * sphere.radius;
}

Vector3d support(const ConvexPoints& points, const Vector3d& d) {
  Eigen::Index best = 0;
  (points.vertices.transpose() * d).maxCoeff(&best);
  return points.vertices.col(best);
}

struct Face {
  std::array<int, 3> corners{};           // counter-clockwise from outside
  std::array<int, 3> beside{-1, -1, -1};  // face across the edge corners[i], corners[i + 1]
  Vector3d normal = Vector3d::Zero();     // unit, outward
  double distance = 0;  // of its plane from the origin along the normal; negative: the origin is outside
  bool alive = true;
};

// The polytope inside the Minkowski difference A - B, extended by one support point at a time.
class Difference {
 public:
  Difference(const ConvexShape& a, const ConvexShape& b, const Pose& X_AB) : a_(a), b_(b), X_AB_(X_AB) {}

  ConvexDepth solve(const Vector3d& towards, bool exact);

 private:
  static constexpr int kMaxPoints = 400;
  static constexpr double kExact = 1e-8;  // m

  [[nodiscard]] Vector3d furthest(const Vector3d& d) const {
    return support_point(a_, d) - X_AB_ * support_point(b_, -(X_AB_.linear().transpose() * d));
  }
  bool start(const Vector3d& towards);
  bool grow(const Vector3d& point, int seen_from);
  int add_face(int i, int j, int k);
  [[nodiscard]] bool above(const Face& face, const Vector3d& point) const {
    return face.normal.dot(point - points_[face.corners[0]]) > kExact * 1e-3;
  }
  [[nodiscard]] int nearest_face() const;

  const ConvexShape& a_;
  const ConvexShape& b_;
  const Pose& X_AB_;
  std::vector<Vector3d> points_;
  std::vector<Face> faces_;
  std::vector<int> visible_, rim_face_;
};

int Difference::add_face(int i, int j, int k) {
  Face face;
  face.corners = {i, j, k};
  const Vector3d cross = (points_[j] - points_[i]).cross(points_[k] - points_[i]);
  face.normal = cross.normalized();
  face.distance = face.normal.dot(points_[i]);
  faces_.push_back(face);
  return static_cast<int>(faces_.size()) - 1;
}

// Finds four points that span a volume. False: A - B is flat.
bool Difference::start(const Vector3d& towards) {
  const double flat = 1e-9;
  points_ = {furthest(towards)};
  for (int axis = 0; axis < 6 && points_.size() < 2; ++axis) {
    const Vector3d d = (axis % 2 == 0 ? -1.0 : 1.0) * (axis < 2 ? towards : Vector3d::Unit(axis / 2));
    const Vector3d p = furthest(d);
    if ((p - points_[0]).norm() > flat) points_.push_back(p);
  }
  if (points_.size() < 2) return false;
  const Vector3d line = (points_[1] - points_[0]).normalized();
  const Vector3d side = line.unitOrthogonal(), other = line.cross(side);
  for (const Vector3d& d : {side, Vector3d(-side), other, Vector3d(-other)}) {
    const Vector3d p = furthest(d);
    if ((p - points_[0]).cross(line).norm() > flat) {
      points_.push_back(p);
      break;
    }
  }
  if (points_.size() < 3) return false;
  const Vector3d normal = (points_[1] - points_[0]).cross(points_[2] - points_[0]).normalized();
  Vector3d p = furthest(normal);
  if (std::abs((p - points_[0]).dot(normal)) <= flat) p = furthest(-normal);
  if (std::abs((p - points_[0]).dot(normal)) <= flat) return false;
  points_.push_back(p);
  if ((p - points_[0]).dot(normal) > 0) std::swap(points_[1], points_[2]);  // 0 1 2 looks away from 3
  add_face(0, 1, 2);
  add_face(0, 3, 1);
  add_face(1, 3, 2);
  add_face(2, 3, 0);
  faces_[0].beside = {1, 2, 3};
  faces_[1].beside = {3, 2, 0};
  faces_[2].beside = {1, 3, 0};
  faces_[3].beside = {2, 1, 0};
  return true;
}

int Difference::nearest_face() const {
  int best = -1;
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    if (faces_[i].alive && (best < 0 || faces_[i].distance < faces_[best].distance))
      best = static_cast<int>(i);
  }
  return best;
}

// Adds the point to the hull: the faces visible from it are replaced by a cone over their rim. False:
// rounding left no closed rim, and the polytope cannot be extended further.
bool Difference::grow(const Vector3d& point, int seen_from) {
  visible_.assign(1, seen_from);
  faces_[seen_from].alive = false;
  struct Edge {
    int from, to, outside;
  };
  std::vector<Edge> rim;
  for (std::size_t at = 0; at < visible_.size(); ++at) {
    const Face face = faces_[visible_[at]];
    for (int e = 0; e < 3; ++e) {
      Face& next = faces_[face.beside[e]];
      if (!next.alive) continue;
      if (above(next, point)) {
        next.alive = false;
        visible_.push_back(face.beside[e]);
      } else {
        rim.push_back({face.corners[e], face.corners[(e + 1) % 3], face.beside[e]});
      }
    }
  }
  const int apex = static_cast<int>(points_.size());
  points_.push_back(point);
  rim_face_.assign(points_.size(), -1);
  for (const Edge& edge : rim) {
    if (rim_face_[edge.from] >= 0) return false;
    const int fresh = add_face(edge.from, edge.to, apex);
    rim_face_[edge.from] = fresh;
    faces_[fresh].beside = {edge.outside, -1, -1};
    Face& outside = faces_[edge.outside];
    for (int e = 0; e < 3; ++e) {
      if (outside.corners[e] == edge.to && outside.corners[(e + 1) % 3] == edge.from)
        outside.beside[e] = fresh;
    }
  }
  for (const Edge& edge : rim) {
    const int mine = rim_face_[edge.from], next = rim_face_[edge.to];
    if (next < 0) return false;
    faces_[mine].beside[1] = next;
    faces_[next].beside[2] = mine;
  }
  return true;
}

ConvexDepth Difference::solve(const Vector3d& towards, bool exact) {
  double least = furthest(towards).dot(towards);  // over all directions so far: a bound of the depth
  if (least <= kTouching || !start(towards)) return {};
  while (static_cast<int>(points_.size()) < kMaxPoints) {
    const int at = nearest_face();
    const Face& face = faces_[at];
    const Vector3d point = furthest(face.normal);
    const double way_out = face.normal.dot(point);
    least = std::min(least, way_out);
    if (least <= kTouching) return {};
    if (!exact && face.distance > kTouching) return {true, face.distance};
    if (least - face.distance < kExact || !above(face, point) || !grow(point, at)) break;
  }
  return {true, least};
}

}  // namespace

Vector3d support_point(const ConvexShape& shape, const Vector3d& d) {
  return std::visit([&d](const auto& s) { return support(s, d); }, shape);
}

ConvexSolid::ConvexSolid(ConvexShape the_shape) : shape(std::move(the_shape)) {
  if (const auto* points = std::get_if<ConvexPoints>(&shape)) {
    centre = 0.5 * (points->vertices.rowwise().minCoeff() + points->vertices.rowwise().maxCoeff());
    radius = (points->vertices.colwise() - centre).colwise().norm().maxCoeff();
  } else if (const auto* box = std::get_if<Box>(&shape)) {
    radius = 0.5 * box->size.norm();
  } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    radius = std::hypot(cylinder->radius, 0.5 * cylinder->length);
  } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    radius = capsule->radius + 0.5 * capsule->length;
  } else {
    radius = std::get<Sphere>(shape).radius;
  }
}

ConvexDepth convex_depth(const ConvexSolid& a, const ConvexSolid& b, const Pose& X_AB, bool exact) {
  Vector3d towards = X_AB * b.centre - a.centre;
  const double apart = towards.norm();
  if (apart > a.radius + b.radius) return {};
  towards = apart > 1e-9 ? Vector3d(towards / apart) : Vector3d::UnitZ();
  return Difference(a.shape, b.shape, X_AB).solve(towards, exact);
}

}  // namespace doppel
