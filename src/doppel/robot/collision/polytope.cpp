// The expanding polytope of convex.h.
#include "doppel/robot/collision/detail/polytope.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr double kExact = 1e-8;      // m
constexpr double kFlat = 1e-9;       // m
constexpr double kOnSurface = 1e-6;  // m

}  // namespace

void Polytope::add_point(const DifferencePoint& point) {
  m_.points.push_back(point.p);
  m_.points_of_a.push_back(point.p_A);
}

int Polytope::add_face(int i, int j, int k) {
  Face face;
  face.corners = {i, j, k};
  const Vector3d cross = (m_.points[j] - m_.points[i]).cross(m_.points[k] - m_.points[i]);
  face.normal = cross.normalized();
  face.distance = face.normal.dot(m_.points[i]);
  m_.faces.push_back(face);
  return static_cast<int>(m_.faces.size()) - 1;
}

bool Polytope::above(const Face& face, const Vector3d& point) const {
  return face.normal.dot(point - m_.points[face.corners[0]]) > kExact * 1e-3;
}

// Finds four points that span a volume. False: A - B is flat.
bool Polytope::start(const Vector3d& towards) {
  add_point(difference_.support(towards));
  for (int axis = 0; axis < 6 && m_.points.size() < 2; ++axis) {
    const Vector3d d = (axis % 2 == 0 ? -1.0 : 1.0) * (axis < 2 ? towards : Vector3d::Unit(axis / 2));
    const DifferencePoint point = difference_.support(d);
    if ((point.p - m_.points[0]).norm() > kFlat) add_point(point);
  }
  flat_normal_ = towards;
  if (m_.points.size() < 2) return false;
  const Vector3d line = (m_.points[1] - m_.points[0]).normalized();
  const Vector3d side = line.unitOrthogonal(), other = line.cross(side);
  flat_normal_ = side;
  for (const Vector3d& d : {side, Vector3d(-side), other, Vector3d(-other)}) {
    const DifferencePoint point = difference_.support(d);
    if ((point.p - m_.points[0]).cross(line).norm() > kFlat) {
      add_point(point);
      break;
    }
  }
  if (m_.points.size() < 3) return false;
  flat_normal_ = (m_.points[1] - m_.points[0]).cross(m_.points[2] - m_.points[0]).normalized();
  DifferencePoint last = difference_.support(flat_normal_);
  const auto height = [&] { return (last.p - m_.points[0]).dot(flat_normal_); };
  if (std::abs(height()) <= kFlat) last = difference_.support(-flat_normal_);
  if (std::abs(height()) <= kFlat) return false;
  add_point(last);
  if (height() > 0) {  // the face 0 1 2 looks away from 3
    std::swap(m_.points[1], m_.points[2]);
    std::swap(m_.points_of_a[1], m_.points_of_a[2]);
  }
  add_face(0, 1, 2);
  add_face(0, 3, 1);
  add_face(1, 3, 2);
  add_face(2, 3, 0);
  m_.faces[0].beside = {1, 2, 3};
  m_.faces[1].beside = {3, 2, 0};
  m_.faces[2].beside = {1, 3, 0};
  m_.faces[3].beside = {2, 1, 0};
  return true;
}

int Polytope::nearest_face() const {
  int best = -1;
  for (std::size_t i = 0; i < m_.faces.size(); ++i) {
    if (m_.faces[i].alive && (best < 0 || m_.faces[i].distance < m_.faces[best].distance))
      best = static_cast<int>(i);
  }
  return best;
}

// Adds the point to the hull: the faces visible from it are replaced by a cone over their rim. False:
// rounding left no closed rim, and the polytope cannot be extended further.
bool Polytope::grow(const DifferencePoint& point, int seen_from) {
  m_.visible.assign(1, seen_from);
  m_.rim.clear();
  m_.faces[seen_from].alive = false;
  for (std::size_t i = 0; i < m_.visible.size(); ++i) {
    const Face face = m_.faces[m_.visible[i]];
    for (int e = 0; e < 3; ++e) {
      Face& next = m_.faces[face.beside[e]];
      if (!next.alive) continue;
      if (above(next, point.p)) {
        next.alive = false;
        m_.visible.push_back(face.beside[e]);
      } else {
        m_.rim.push_back({face.corners[e], face.corners[(e + 1) % 3], face.beside[e]});
      }
    }
  }
  if (m_.faces.size() + m_.rim.size() > kMaxPolytopeFaces) return false;
  const int apex = static_cast<int>(m_.points.size());
  add_point(point);
  m_.rim_face.assign(m_.points.size(), -1);
  for (const ConvexWorkspace::Edge& edge : m_.rim) {
    if (m_.rim_face[edge.begin] >= 0) return false;
    const int fresh = add_face(edge.begin, edge.end, apex);
    m_.rim_face[edge.begin] = fresh;
    m_.faces[fresh].beside = {edge.outside, -1, -1};
    Face& outside = m_.faces[edge.outside];
    for (int e = 0; e < 3; ++e) {
      if (outside.corners[e] == edge.end && outside.corners[(e + 1) % 3] == edge.begin)
        outside.beside[e] = fresh;
    }
  }
  for (const ConvexWorkspace::Edge& edge : m_.rim) {
    const int mine = m_.rim_face[edge.begin], next = m_.rim_face[edge.end];
    if (next < 0) return false;
    m_.faces[mine].beside[1] = next;
    m_.faces[next].beside[2] = mine;
  }
  return true;
}

// The point of A at p, a point of the polytope's surface: by the face that holds it, which need not be the
// nearest one where several are in one plane.
std::optional<Vector3d> Polytope::point_of_a(const Vector3d& p, double depth) const {
  std::optional<Vector3d> out;
  double best = -std::numeric_limits<double>::infinity();
  for (const Face& face : m_.faces) {
    if (!face.alive || face.distance > depth + kOnSurface || best >= 0) continue;
    const auto& [i, j, k] = face.corners;
    const auto share = [&](int u, int v) {
      return (m_.points[u] - p).cross(m_.points[v] - p).dot(face.normal);
    };
    Vector3d shares(share(j, k), share(k, i), share(i, j));
    const double inside = shares.minCoeff() / shares.cwiseAbs().sum();
    if (!(inside > best)) continue;
    best = inside;
    shares = shares.cwiseMax(0.0);
    shares /= shares.sum();
    out = shares[0] * m_.points_of_a[i] + shares[1] * m_.points_of_a[j] + shares[2] * m_.points_of_a[k];
  }
  return out;
}

PolytopeDepth Polytope::solve(const Vector3d& towards, double threshold, bool exact) {
  m_.points.clear();
  m_.points_of_a.clear();
  m_.faces.clear();
  // The depth is the least over all directions of the distance along it; that of each direction is a bound.
  PolytopeDepth out;
  out.normal = towards;
  out.depth = difference_.support(towards).p.dot(towards);
  if (out.depth <= threshold) return out;
  if (!start(towards)) return {0.0, flat_normal_};
  while (m_.points.size() < kMaxPolytopePoints) {
    const int nearest = nearest_face();
    const Face face = m_.faces[nearest];
    const DifferencePoint point = difference_.support(face.normal);
    const double way_out = face.normal.dot(point.p);
    if (way_out < out.depth) {
      out.depth = way_out;
      out.normal = face.normal;
    }
    if (out.depth <= threshold) return out;
    if (!exact && face.distance > threshold) return out;
    if (out.depth - face.distance < kExact || !above(face, point.p) || !grow(point, nearest)) break;
  }
  if (exact) out.p_A = point_of_a(out.depth * out.normal, out.depth);
  return out;
}

}  // namespace doppel
