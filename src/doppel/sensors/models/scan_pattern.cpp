#include "doppel/sensors/models/scan_pattern.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

int count_of(const ScanRange& range) {
  return std::max(1, static_cast<int>(std::lround(range.samples * range.resolution)));
}

double increment_of(const ScanRange& range, int count) {
  return count > 1 ? (range.max - range.min) / (count - 1) : 0;
}

Eigen::Map<Eigen::ArrayXf> row(std::vector<float>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}
Eigen::Map<const Eigen::ArrayXf> row(const std::vector<float>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

}  // namespace

void ScanPattern::add(const Eigen::Vector3d& direction) {
  x.push_back(static_cast<float>(direction.x()));
  y.push_back(static_cast<float>(direction.y()));
  z.push_back(static_cast<float>(direction.z()));
}

ScanPattern scan_pattern(const LidarDescription& lidar) {
  ScanPattern out;
  out.columns = count_of(lidar.horizontal);
  out.rings = count_of(lidar.vertical);
  out.angle_min = lidar.horizontal.min;
  out.angle_increment = increment_of(lidar.horizontal, out.columns);
  out.angle_max = out.columns > 1 ? lidar.horizontal.max : lidar.horizontal.min;
  const double step = increment_of(lidar.vertical, out.rings);
  for (int r = 0; r < out.rings; ++r) {
    const double e = lidar.vertical.min + r * step;
    out.elevations.push_back(e);
    for (int c = 0; c < out.columns; ++c) {
      const double a = out.angle_min + c * out.angle_increment;
      out.add({std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)});
    }
  }
  return out;
}

void place_rays(const ScanPattern& pattern, const PoseMotion& link, const Pose& X_LS, double scan_time,
                RayBatch& out) {
  const bool moves = link.moves_in(scan_time);
  out.resize(pattern.size(), moves ? pattern.size() : 1);
  Pose X_WS = link.X_WF * X_LS;
  Eigen::Matrix3f R = X_WS.linear().cast<float>();
  Eigen::Vector3f p = X_WS.translation().cast<float>();
  const auto columns = static_cast<std::size_t>(pattern.columns),
             rings = static_cast<std::size_t>(pattern.rings);
  out.columns = columns;
  if (!moves) {
    out.origin_x[0] = p.x();
    out.origin_y[0] = p.y();
    out.origin_z[0] = p.z();
    const auto x = row(pattern.x), y = row(pattern.y), z = row(pattern.z);
    row(out.direction_x) = R(0, 0) * x + R(0, 1) * y + R(0, 2) * z;
    row(out.direction_y) = R(1, 0) * x + R(1, 1) * y + R(1, 2) * z;
    row(out.direction_z) = R(2, 0) * x + R(2, 1) * y + R(2, 2) * z;
    return;
  }
  for (std::size_t c = 0; c < columns; ++c) {
    X_WS = link.at(scan_time * (static_cast<double>(c) / static_cast<double>(columns) - 1)) * X_LS;
    R = X_WS.linear().cast<float>();
    p = X_WS.translation().cast<float>();
    for (std::size_t r = 0; r < rings; ++r) {
      const std::size_t i = r * columns + c;
      const Eigen::Vector3f d = R * pattern.direction(i);
      out.direction_x[i] = d.x();
      out.direction_y[i] = d.y();
      out.direction_z[i] = d.z();
      out.origin_x[i] = p.x();
      out.origin_y[i] = p.y();
      out.origin_z[i] = p.z();
    }
  }
}

ScanPattern cone_pattern(const RangeDescription& range) {
  ScanPattern out;
  constexpr int kCircles = 10;
  out.add(Eigen::Vector3d::UnitX());
  for (int circle = 1; circle <= kCircles; ++circle) {
    const double theta = range.field_of_view / 2 * circle / kCircles;
    const int points = 6 * circle;
    for (int i = 0; i < points; ++i) {
      const double a = 2 * M_PI * i / points;
      out.add({std::cos(theta), std::sin(theta) * std::cos(a), std::sin(theta) * std::sin(a)});
    }
  }
  out.columns = static_cast<int>(out.size());
  return out;
}

}  // namespace doppel
