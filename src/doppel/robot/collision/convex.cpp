#include "doppel/robot/collision/detail/convex.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "doppel/robot/collision/detail/polytope.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

Vector3d support_of(const Box& box, const Vector3d& d) {
  return 0.5 * box.size.cwiseProduct(d.unaryExpr([](double x) { return x < 0 ? -1.0 : 1.0; }));
}

Vector3d support_of(const Cylinder& cylinder, const Vector3d& d) {
  const double across = d.head<2>().norm(), half = d.z() < 0 ? -0.5 : 0.5;
  Vector3d point(0, 0, half * cylinder.length);
  if (across > 0) point.head<2>() = d.head<2>() * (cylinder.radius / across);
  return point;
}

Vector3d support_of(const Capsule& capsule, const Vector3d& d) {
  return {0, 0, (d.z() < 0 ? -0.5 : 0.5) * capsule.length};
}

Vector3d support_of(const Sphere& /*sphere*/, const Vector3d& /*d*/) {
  return Vector3d::Zero();
}

Vector3d support_of(const Ellipsoid& ellipsoid, const Vector3d& d) {
  const Vector3d scaled = ellipsoid.radii.cwiseProduct(d);
  return ellipsoid.radii.cwiseProduct(scaled) / scaled.norm();
}

Vector3d support_of(const ConvexPoints& points, const Vector3d& d) {
  const Eigen::Matrix3Xd& p = points.vertices;
  Eigen::Index best = 0;
  double most = p.col(0).dot(d);
  for (Eigen::Index i = 1; i < p.cols(); ++i) {
    const double along = p.col(i).dot(d);
    if (along > most) {
      most = along;
      best = i;
    }
  }
  return p.col(best);
}

constexpr Eigen::Index kBlock = 32;  // vertices

// The same point: the block of the largest height first, then the vertex in it.
Vector3d support_in_blocks(const Eigen::Array<double, Eigen::Dynamic, 3>& p, const Vector3d& d) {
  const Eigen::Index count = p.rows();
  Eigen::Array<double, kBlock, 1> heights;
  double most = -std::numeric_limits<double>::infinity();
  Eigen::Index best = 0;
  for (Eigen::Index first = 0; first < count; first += kBlock) {
    // The last block overlaps the one before it.
    const Eigen::Index start = std::min(first, count - kBlock);
    heights = d.x() * p.col(0).segment<kBlock>(start) +
              (d.y() * p.col(1).segment<kBlock>(start) + d.z() * p.col(2).segment<kBlock>(start));
    if (const double highest = heights.maxCoeff(); highest > most) {
      most = highest;
      best = start;
      while (heights[best - start] != highest) ++best;
    }
  }
  return p.row(best).transpose();
}

}  // namespace

ConvexWorkspace::ConvexWorkspace() {
  points.reserve(kMaxPolytopePoints);
  points_of_a.reserve(kMaxPolytopePoints);
  rim_face.reserve(kMaxPolytopePoints);
  faces.reserve(kMaxPolytopeFaces);
  visible.reserve(kMaxPolytopeFaces);
  rim.reserve(kMaxPolytopeFaces);
}

ConvexSolid::ConvexSolid(ConvexShape the_shape) : shape(std::move(the_shape)) {
  if (const auto* points = std::get_if<ConvexPoints>(&shape)) {
    centre = 0.5 * (points->vertices.rowwise().minCoeff() + points->vertices.rowwise().maxCoeff());
    radius = (points->vertices.colwise() - centre).colwise().norm().maxCoeff();
    if (points->vertices.cols() >= kBlock) columns = points->vertices.transpose().array();
  } else if (const auto* box = std::get_if<Box>(&shape)) {
    radius = 0.5 * box->size.norm();
  } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    radius = std::hypot(cylinder->radius, 0.5 * cylinder->length);
  } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    rounding = capsule->radius;
    radius = capsule->radius + 0.5 * capsule->length;
  } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&shape)) {
    radius = ellipsoid->radii.maxCoeff();
  } else {
    radius = rounding = std::get<Sphere>(shape).radius;
  }
}

Vector3d ConvexSolid::support(const Vector3d& d) const {
  if (columns.rows() > 0) return support_in_blocks(columns, d);
  return std::visit([&d](const auto& s) { return support_of(s, d); }, shape);
}

}  // namespace doppel
