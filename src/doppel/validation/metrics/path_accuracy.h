#pragma once
// The path characteristics of ISO 9283:1998, clause 8: accuracy, repeatability, velocity, corners.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "doppel/export.h"
#include "doppel/validation/metrics/pose_accuracy.h"

namespace doppel {

using MeasuredPath = std::vector<MeasuredPose>;

// The poses of an attained path in the planes that are normal to the commanded path at its points: the
// first passage of each plane, in order, linear between samples. A plane that the attained path begins
// behind, or does not reach, has its first or last pose. None with fewer than two points, equal neighbours
// in `commanded`, or a value that is not finite.
DOPPEL_API std::optional<MeasuredPath> at_normal_planes(std::span<const MeasuredPose> attained,
                                                        std::span<const MeasuredPose> commanded);

// The cycles of one path (8.2, 8.3). S: the sample standard deviation over cycles.
struct PathFigures {
  double accuracy = 0;                                            // m: AT_P = max |mean_i - commanded_i|
  Eigen::Vector3d angle_accuracy = Eigen::Vector3d::Zero();       // rad: AT_a = max |mean a_i - a_ci|, ...
  double repeatability = 0;                                       // m: RT_P = max (mean(l_i) + 3 S(l_i))
  Eigen::Vector3d angle_repeatability = Eigen::Vector3d::Zero();  // rad: RT_a = max 3 S(a_i), ...
  std::size_t accuracy_point = 0;  // of the commanded path, with the largest value
  std::size_t repeatability_point = 0;
};

// Each cycle has one pose for each commanded one, as at_normal_planes gives. None with fewer than two
// cycles, no points, unequal numbers, or a value that is not finite.
DOPPEL_API std::optional<PathFigures> path_figures(std::span<const MeasuredPath> cycles,
                                                   std::span<const MeasuredPose> commanded);

// The speed along a path, without its acceleration and deceleration (8.6).
struct VelocityFigures {
  double accuracy = 0;       // of the commanded speed: AV = (mean v - v_c) / v_c
  double repeatability = 0;  // of the commanded speed: RV = 3 S(mean v_j) / v_c
  double fluctuation = 0;    // m/s: FV = max over cycles of (max v - min v)
};

// `cycles`: m/s, the samples of each. None with fewer than two cycles, an empty one, a value that is not
// finite, or a commanded speed that is not positive.
DOPPEL_API std::optional<VelocityFigures> velocity_figures(std::span<const std::vector<double>> cycles,
                                                           double commanded);

struct CornerFigures {
  double round_off = 0;  // m: CR, smallest distance between the corner and the attained path
  double overshoot = 0;  // m: CO, largest distance from the second line beyond the corner, on its outer side
};

// A path with a corner (8.5). `before`, `after`: directions of the commanded lines, of any length. The
// outer side is that to which `before` points. None with fewer than two positions, parallel lines, or a
// value that is not finite.
DOPPEL_API std::optional<CornerFigures> corner_figures(std::span<const Eigen::Vector3d> attained,
                                                       const Eigen::Vector3d& corner,
                                                       const Eigen::Vector3d& before,
                                                       const Eigen::Vector3d& after);

}  // namespace doppel
