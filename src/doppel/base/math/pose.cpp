#include "doppel/base/math/pose.h"

#include <cmath>

namespace doppel {

Eigen::Matrix3d rotation_from_rpy(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector3d rpy_from_rotation(const Eigen::Matrix3d& R) {
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  const double pitch = std::atan2(-R(2, 0), cos_pitch);
  if (cos_pitch < 1e-12) return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

// Own code, because Eigen's FromTwoVectors() determines the axis of the opposite case by a singular value
// decomposition, which adds five seconds to the compilation of each file that calls it, and is less accurate
// near that case.
Eigen::Matrix3d rotation_from_z(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d to = direction.normalized();
  const double sin_angle = std::hypot(to.x(), to.y());
  if (sin_angle == 0) return Eigen::Vector3d(1, to.z(), to.z()).asDiagonal();
  // Sine and cosine of the half angle, each from a sum without cancellation.
  const double larger = std::sqrt(0.5 * (1.0 + std::abs(to.z())));
  const double smaller = 0.5 * sin_angle / larger;
  const double sine = to.z() < 0 ? larger : smaller;
  const double cosine = to.z() < 0 ? smaller : larger;
  const Eigen::Quaterniond q(cosine, -to.y() / sin_angle * sine, to.x() / sin_angle * sine, 0);
  return q.toRotationMatrix();
}

Pose make_pose(const Eigen::Vector3d& xyz, const Eigen::Vector3d& rpy) {
  Pose X = Pose::Identity();
  X.linear() = rotation_from_rpy(rpy);
  X.translation() = xyz;
  return X;
}

}  // namespace doppel
