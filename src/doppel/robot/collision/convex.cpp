#include "doppel/robot/collision/detail/convex.h"

#include <cmath>
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
  return std::visit([&d](const auto& s) { return support_of(s, d); }, shape);
}

}  // namespace doppel
