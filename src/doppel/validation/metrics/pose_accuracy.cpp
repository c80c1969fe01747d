#include "doppel/validation/metrics/pose_accuracy.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "doppel/validation/metrics/detail/cloud.h"
#include "doppel/validation/metrics/detail/samples.h"

namespace doppel {
namespace {

// The way s in [0, 1] on the line from a to b at which the distance from the centre passes the radius; one
// end is inside and the other is not.
double sphere_crossing(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& centre,
                       double radius) {
  const Eigen::Vector3d line = b - a, start = a - centre;
  const double p = line.squaredNorm(), q = line.dot(start), r = start.squaredNorm() - radius * radius;
  const double root = std::sqrt(std::max(0.0, q * q - p * r));
  const double way = r > 0 ? (-q - root) / p : (-q + root) / p;
  return std::clamp(way, 0.0, 1.0);
}

}  // namespace

std::optional<PoseFigures> pose_figures(std::span<const MeasuredPose> attained,
                                        const MeasuredPose& commanded) {
  if (attained.size() < 2 || !all_finite(attained) || !is_finite(commanded)) return std::nullopt;
  std::vector<Eigen::Vector3d> positions, angles;
  for (const MeasuredPose& pose : attained) {
    positions.push_back(pose.position);
    angles.push_back(angles_near(pose.angles, commanded.angles));
  }
  PoseFigures out;
  out.mean = {mean_of(positions), mean_of(angles)};
  out.axis_accuracy = out.mean.position - commanded.position;
  out.accuracy = out.axis_accuracy.norm();
  out.angle_accuracy = out.mean.angles - commanded.angles;
  out.repeatability = radius_of(positions, out.mean.position);
  out.angle_repeatability = 3 * deviation_of(angles);
  return out;
}

std::optional<DirectionFigures> direction_figures(std::span<const PoseFigures> directions) {
  if (directions.size() < 2) return std::nullopt;
  DirectionFigures out;
  for (std::size_t h = 0; h < directions.size(); ++h)
    for (std::size_t k = 0; k < h; ++k) {
      const MeasuredPose &a = directions[h].mean, &b = directions[k].mean;
      out.position = std::max(out.position, (a.position - b.position).norm());
      out.angles = out.angles.cwiseMax((a.angles - b.angles).cwiseAbs());
    }
  return out;
}

std::optional<DistanceFigures> distance_figures(std::span<const MeasuredPose> first,
                                                std::span<const MeasuredPose> second,
                                                const MeasuredPose& commanded_first,
                                                const MeasuredPose& commanded_second) {
  if (first.size() < 2 || first.size() != second.size() || !all_finite(first) || !all_finite(second) ||
      !is_finite(commanded_first) || !is_finite(commanded_second))
    return std::nullopt;
  std::vector<double> distances;
  std::vector<Eigen::Vector3d> axes, angles;
  for (std::size_t j = 0; j < first.size(); ++j) {
    const Eigen::Vector3d way = first[j].position - second[j].position;
    distances.push_back(way.norm());
    axes.emplace_back(way.cwiseAbs());
    angles.emplace_back((angles_near(first[j].angles, commanded_first.angles) -
                         angles_near(second[j].angles, commanded_second.angles))
                            .cwiseAbs());
  }
  const Eigen::Vector3d commanded = commanded_first.position - commanded_second.position;
  DistanceFigures out;
  out.accuracy = mean_of(distances) - commanded.norm();
  out.axis_accuracy = mean_of(axes) - commanded.cwiseAbs();
  out.angle_accuracy = mean_of(angles) - (commanded_first.angles - commanded_second.angles).cwiseAbs();
  out.repeatability = 3 * deviation_of(distances);
  out.axis_repeatability = 3 * deviation_of(axes);
  out.angle_repeatability = 3 * deviation_of(angles);
  return out;
}

std::optional<DriftFigures> drift_figures(std::span<const PoseFigures> over_time) {
  if (over_time.empty()) return std::nullopt;
  const PoseFigures& first = over_time.front();
  DriftFigures out;
  for (const PoseFigures& later : over_time) {
    out.accuracy = std::max(out.accuracy, std::abs(first.accuracy - later.accuracy));
    out.angle_accuracy =
        out.angle_accuracy.cwiseMax((first.angle_accuracy - later.angle_accuracy).cwiseAbs());
    out.repeatability = std::max(out.repeatability, std::abs(first.repeatability - later.repeatability));
    out.angle_repeatability =
        out.angle_repeatability.cwiseMax((first.angle_repeatability - later.angle_repeatability).cwiseAbs());
  }
  return out;
}

std::optional<ApproachFigures> approach_figures(std::span<const double> time,
                                                std::span<const Eigen::Vector3d> positions,
                                                const Eigen::Vector3d& attained, double limit_band) {
  std::vector<double> distances;
  for (const Eigen::Vector3d& position : positions) distances.push_back((position - attained).norm());
  if (!is_sampled_signal(time, distances, 1) || !(limit_band > 0) || !std::isfinite(limit_band))
    return std::nullopt;
  const auto inside = [&](std::size_t i) { return distances[i] <= limit_band; };
  const auto entry = [&](std::size_t i) {  // sample i is the first one inside
    if (i == 0) return time[0];
    const double way = sphere_crossing(positions[i - 1], positions[i], attained, limit_band);
    return std::lerp(time[i - 1], time[i], way);
  };
  std::size_t first = 0, last = distances.size();
  while (first < distances.size() && !inside(first)) ++first;
  ApproachFigures out;
  out.reached = first < distances.size();
  if (!out.reached) return out;
  out.first_inside = entry(first);
  const double farthest =
      *std::max_element(distances.begin() + static_cast<std::ptrdiff_t>(first), distances.end());
  if (farthest > limit_band) out.overshoot = farthest;
  while (last > 0 && inside(last - 1)) --last;
  out.stays = last < distances.size();
  out.inside_for_good = out.stays ? entry(last) : time.back();
  out.stabilisation = out.inside_for_good - out.first_inside;
  return out;
}

}  // namespace doppel
