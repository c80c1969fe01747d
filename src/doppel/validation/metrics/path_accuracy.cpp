#include "doppel/validation/metrics/path_accuracy.h"

#include <algorithm>
#include <cmath>

#include "doppel/validation/metrics/detail/cloud.h"
#include "doppel/validation/metrics/detail/samples.h"

namespace doppel {
namespace {

// A place on an attained path: `way` in [0, 1) of the line after a sample.
struct PathPlace {
  std::size_t sample = 0;
  double way = 0;
};

MeasuredPose pose_at(std::span<const MeasuredPose> path, const PathPlace& place,
                     const Eigen::Vector3d& commanded_angles) {
  const MeasuredPose& a = path[place.sample];
  const MeasuredPose& b = path[std::min(place.sample + 1, path.size() - 1)];
  const Eigen::Vector3d angles = angles_near(a.angles, commanded_angles);
  return {a.position + place.way * (b.position - a.position),
          angles + place.way * (angles_near(b.angles, commanded_angles) - angles)};
}

// The first passage of the plane through `point`, in the direction of its normal, not before `place`.
PathPlace passage(std::span<const MeasuredPose> path, PathPlace place, const Eigen::Vector3d& point,
                  const Eigen::Vector3d& normal) {
  const auto height = [&](std::size_t i) { return normal.dot(path[i].position - point); };
  if (place.sample + 1 >= path.size()) return place;
  const double reached = std::lerp(height(place.sample), height(place.sample + 1), place.way);
  if (reached >= 0) return place;
  for (std::size_t i = place.sample; i + 1 < path.size(); ++i) {
    const double before = height(i), after = height(i + 1);
    if (after >= 0 && after > before) return {i, std::max(0.0, -before / (after - before))};
  }
  return {path.size() - 1, 0};
}

double distance_from_line(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d line = b - a;
  const double square = line.squaredNorm();
  const double way = square > 0 ? std::clamp(line.dot(point - a) / square, 0.0, 1.0) : 0.0;
  return (a + way * line - point).norm();
}

}  // namespace

std::optional<MeasuredPath> at_normal_planes(std::span<const MeasuredPose> attained,
                                             std::span<const MeasuredPose> commanded) {
  if (attained.size() < 2 || commanded.size() < 2 || !all_finite(attained) || !all_finite(commanded))
    return std::nullopt;
  MeasuredPath out;
  out.reserve(commanded.size());
  PathPlace place;
  for (std::size_t i = 0; i < commanded.size(); ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, commanded.size() - 1);
    if (commanded[i].position == commanded[i == 0 ? 1 : i - 1].position) return std::nullopt;
    const Eigen::Vector3d normal = commanded[after].position - commanded[before].position;
    place = passage(attained, place, commanded[i].position, normal);
    out.push_back(pose_at(attained, place, commanded[i].angles));
  }
  return out;
}

std::optional<PathFigures> path_figures(std::span<const MeasuredPath> cycles,
                                        std::span<const MeasuredPose> commanded) {
  const auto fits = [&](const MeasuredPath& cycle) {
    return cycle.size() == commanded.size() && all_finite(cycle);
  };
  if (cycles.size() < 2 || commanded.empty() || !all_finite(commanded) || !std::ranges::all_of(cycles, fits))
    return std::nullopt;
  PathFigures out;
  std::vector<MeasuredPose> cloud(cycles.size());
  for (std::size_t i = 0; i < commanded.size(); ++i) {
    for (std::size_t j = 0; j < cycles.size(); ++j) cloud[j] = cycles[j][i];
    const auto figures = pose_figures(cloud, commanded[i]);
    if (!figures) return std::nullopt;
    if (figures->accuracy > out.accuracy) out.accuracy_point = i;
    if (figures->repeatability > out.repeatability) out.repeatability_point = i;
    out.accuracy = std::max(out.accuracy, figures->accuracy);
    out.repeatability = std::max(out.repeatability, figures->repeatability);
    out.angle_accuracy = out.angle_accuracy.cwiseMax(figures->angle_accuracy.cwiseAbs());
    out.angle_repeatability = out.angle_repeatability.cwiseMax(figures->angle_repeatability);
  }
  return out;
}

std::optional<VelocityFigures> velocity_figures(std::span<const std::vector<double>> cycles,
                                                double commanded) {
  const auto fits = [](const std::vector<double>& cycle) { return !cycle.empty() && all_finite(cycle); };
  if (cycles.size() < 2 || !(commanded > 0) || !std::isfinite(commanded) ||
      !std::ranges::all_of(cycles, fits))
    return std::nullopt;
  VelocityFigures out;
  std::vector<double> means;
  for (const std::vector<double>& cycle : cycles) {
    means.push_back(mean_of(cycle));
    const auto [low, high] = std::ranges::minmax(cycle);
    out.fluctuation = std::max(out.fluctuation, high - low);
  }
  out.accuracy = (mean_of(means) - commanded) / commanded;
  out.repeatability = 3 * deviation_of(means) / commanded;
  return out;
}

std::optional<CornerFigures> corner_figures(std::span<const Eigen::Vector3d> attained,
                                            const Eigen::Vector3d& corner, const Eigen::Vector3d& before,
                                            const Eigen::Vector3d& after) {
  const auto finite = [](const Eigen::Vector3d& position) { return position.allFinite(); };
  if (attained.size() < 2 || !std::ranges::all_of(attained, finite) || !corner.allFinite() ||
      !before.allFinite() || !after.allFinite() || !(after.norm() > 0))
    return std::nullopt;
  const Eigen::Vector3d forward = after.normalized();
  Eigen::Vector3d outside = before - before.dot(forward) * forward;
  if (!(outside.norm() > 1e-9 * before.norm())) return std::nullopt;
  outside.normalize();
  CornerFigures out;
  out.round_off = (attained.front() - corner).norm();
  for (std::size_t i = 0; i + 1 < attained.size(); ++i)
    out.round_off = std::min(out.round_off, distance_from_line(corner, attained[i], attained[i + 1]));
  for (const Eigen::Vector3d& position : attained) {
    const Eigen::Vector3d way = position - corner;
    const double along = way.dot(forward);
    if (along <= 0 || way.dot(outside) <= 0) continue;
    out.overshoot = std::max(out.overshoot, (way - along * forward).norm());
  }
  return out;
}

}  // namespace doppel
