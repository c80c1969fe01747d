#include "doppel/physics/contract/detail/gyroscopic.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace doppel {
namespace {

constexpr int kIterations = 8;        // at most; three are usual
constexpr double kConverged = 1e-15;  // of the angular velocity

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d out;
  out << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return out;
}

}  // namespace

Eigen::Vector3d gyroscopic_correction(const Eigen::Vector3d& moments, const Eigen::Vector3d& w, double h) {
  const auto momentum = [&](const Eigen::Vector3d& of) { return Eigen::Vector3d(moments.cwiseProduct(of)); };
  const Eigen::Vector3d at_start = w.cross(momentum(w));
  if (at_start.isZero(0.0)) return Eigen::Vector3d::Zero();
  // 2 I (mean - w) + h mean x I mean = 0, by Newton's method.
  Eigen::Vector3d mean = w;
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Vector3d rest = 2.0 * momentum(mean - w) + h * mean.cross(momentum(mean));
    Eigen::Matrix3d slope = h * (cross_matrix(mean) * moments.asDiagonal() - cross_matrix(momentum(mean)));
    slope.diagonal() += 2.0 * moments;
    const Eigen::Vector3d change = slope.inverse() * rest;
    mean -= change;
    if (!(change.norm() > kConverged * w.norm())) break;
  }
  return at_start - mean.cross(momentum(mean));
}

}  // namespace doppel
