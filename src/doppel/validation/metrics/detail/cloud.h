#pragma once
// Sums over clouds of measured poses.

#include <span>
#include <vector>

#include "doppel/validation/metrics/pose_accuracy.h"

namespace doppel {

bool is_finite(const MeasuredPose& pose);
bool all_finite(std::span<const MeasuredPose> poses);

// The angles that are within half a turn of the commanded ones.
Eigen::Vector3d angles_near(const Eigen::Vector3d& angles, const Eigen::Vector3d& commanded);

// mean(l) + 3 S(l) of the distances l from the mean position.
double radius_of(std::span<const Eigen::Vector3d> positions, const Eigen::Vector3d& mean);

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3d> values);
Eigen::Vector3d deviation_of(std::span<const Eigen::Vector3d> values);  // n - 1, by component

}  // namespace doppel
