#include "doppel/validation/metrics/detail/cloud.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/validation/metrics/detail/samples.h"

namespace doppel {

bool is_finite(const MeasuredPose& pose) {
  return pose.position.allFinite() && pose.angles.allFinite();
}

bool all_finite(std::span<const MeasuredPose> poses) {
  return std::ranges::all_of(poses, [](const MeasuredPose& pose) { return is_finite(pose); });
}

Eigen::Vector3d angles_near(const Eigen::Vector3d& angles, const Eigen::Vector3d& commanded) {
  Eigen::Vector3d out = angles;
  for (int i = 0; i < 3; ++i) {
    const double difference = angles[i] - commanded[i];
    // An angle that is near remains as it is, to the last bit.
    if (std::abs(difference) > std::numbers::pi)
      out[i] = commanded[i] + std::remainder(difference, 2 * std::numbers::pi);
  }
  return out;
}

double radius_of(std::span<const Eigen::Vector3d> positions, const Eigen::Vector3d& mean) {
  std::vector<double> distances;
  distances.reserve(positions.size());
  for (const Eigen::Vector3d& position : positions) distances.push_back((position - mean).norm());
  return mean_of(distances) + 3 * deviation_of(distances);
}

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3d> values) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  if (values.empty()) return out;
  for (const Eigen::Vector3d& value : values) out += value;
  return out / static_cast<double>(values.size());
}

Eigen::Vector3d deviation_of(std::span<const Eigen::Vector3d> values) {
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  if (values.size() < 2) return squares;
  const Eigen::Vector3d mean = mean_of(values);
  for (const Eigen::Vector3d& value : values) squares += (value - mean).cwiseAbs2();
  return (squares / static_cast<double>(values.size() - 1)).cwiseSqrt();
}

}  // namespace doppel
