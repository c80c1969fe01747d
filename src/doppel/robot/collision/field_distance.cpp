#include "doppel/robot/collision/detail/field_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr double kSlack = 1e-6;  // m, more than the error of a distance

Vector3d furthest_of(const ConvexSolid& b, const Pose& X_AB, const Vector3d& d) {
  return X_AB * b.support(X_AB.linear().transpose() * d) + b.rounding * d;
}

Eigen::AlignedBox3d bounds_in_field(const ConvexSolid& b, const Pose& X_AB) {
  Eigen::AlignedBox3d out;
  for (int axis = 0; axis < 3; ++axis) {
    out.max()[axis] = furthest_of(b, X_AB, Vector3d::Unit(axis))[axis];
    out.min()[axis] = furthest_of(b, X_AB, -Vector3d::Unit(axis))[axis];
  }
  return out;
}

// The cells of a grid line between two places, m; of at least one.
struct Range {
  int first, last;
};
Range cells_between(double low, double high, double side, int points) {
  const double cell = side / (points - 1);
  const auto index = [&](double x) {
    return static_cast<int>(std::clamp(std::floor((x + 0.5 * side) / cell), 0.0, points - 2.0));
  };
  return {index(low), index(high)};
}

class FieldSearch {
 public:
  FieldSearch(const HeightField& field, const ConvexSolid& b, const Pose& X_AB, FieldWorkspace& cells,
              ConvexWorkspace& memory)
      : field_(field), b_(b), X_AB_(X_AB), prism_(cells.prism), memory_(memory) {}

  ConvexDistance search(double far) {
    const Eigen::AlignedBox3d box = bounds_in_field(b_, X_AB_);
    const Vector3d lowest = furthest_of(b_, X_AB_, -Vector3d::UnitZ());
    bottom_ = std::min<double>(std::ranges::min(field_.heights), lowest.z()) - kSolidBelow;
    // The lowest point of B is not further from the terrain than from the nearest of its points.
    const Vector3d below(std::clamp(lowest.x(), -0.5 * field_.size.x(), 0.5 * field_.size.x()),
                         std::clamp(lowest.y(), -0.5 * field_.size.y(), 0.5 * field_.size.y()), 0);
    const Vector3d surface(below.x(), below.y(), field_.height(below.x(), below.y()));
    out_.distance = std::min(far, (lowest - surface).norm() + kSlack);
    const double reach = out_.distance;
    const Range columns =
        cells_between(box.min().x() - reach, box.max().x() + reach, field_.size.x(), field_.columns);
    const Range rows =
        cells_between(box.min().y() - reach, box.max().y() + reach, field_.size.y(), field_.rows);
    for (int row = rows.first; row <= rows.last; ++row) {
      for (int column = columns.first; column <= columns.last; ++column) {
        const Vector3d p = field_.point(column, row), q = field_.point(column + 1, row),
                       r = field_.point(column + 1, row + 1), s = field_.point(column, row + 1);
        visit({p, q, r});
        visit({p, r, s});
      }
    }
    return out_;
  }

 private:
  void visit(const std::array<Vector3d, 3>& triangle) {
    for (int i = 0; i < 3; ++i) {
      const Vector3d& corner = triangle[static_cast<std::size_t>(i)];
      points().col(i) = corner;
      points().col(i + 3) << corner.x(), corner.y(), bottom_;
    }
    prism_.centre = points().rowwise().mean();
    prism_.radius = (points().colwise() - prism_.centre).colwise().norm().maxCoeff();
    const double limit = std::max(out_.distance, 0.0);
    const double apart = (X_AB_ * b_.centre - prism_.centre).norm() - b_.radius - prism_.radius;
    if (apart > limit) return;
    ConvexDistance found = convex_distance(prism_, b_, X_AB_, limit, memory_);
    if (found.distance < 0) found = below_surface(triangle);
    if (found.distance < out_.distance) out_ = found;
  }

  // The depth below the triangle's plane: the way up, not the way out at a side of the prism.
  [[nodiscard]] ConvexDistance below_surface(const std::array<Vector3d, 3>& triangle) const {
    ConvexDistance out;
    out.normal_A = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
    out.p_B = furthest_of(b_, X_AB_, -out.normal_A);
    out.distance = out.normal_A.dot(out.p_B - triangle[0]);
    out.p_A = out.p_B - out.distance * out.normal_A;
    return out;
  }

  Eigen::Matrix3Xd& points() { return std::get<ConvexPoints>(prism_.shape).vertices; }

  const HeightField& field_;
  const ConvexSolid& b_;
  const Pose& X_AB_;
  ConvexSolid& prism_;
  ConvexWorkspace& memory_;
  double bottom_ = 0;  // m
  ConvexDistance out_;
};

}  // namespace

FieldWorkspace::FieldWorkspace() : prism(ConvexPoints{Eigen::Matrix3Xd::Zero(3, 6)}) {}

ConvexDistance field_distance(const HeightField& field, const ConvexSolid& b, const Pose& X_AB, double far,
                              FieldWorkspace& cells, ConvexWorkspace& memory) {
  return FieldSearch(field, b, X_AB, cells, memory).search(far);
}

}  // namespace doppel
