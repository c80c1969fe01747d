#include "doppel/validation/statics/detail/sensor_fields.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "doppel/sensors/models/lens.h"

namespace doppel {
namespace {

constexpr double kPerCentimetre = 0.01;

PlaceSight sight_of(const CameraIntrinsics& camera, const SensorField& field, const Eigen::Vector3d& p_S) {
  const Eigen::Vector3d p_C = optical_axes().linear().transpose() * p_S;
  const std::optional<Eigen::Vector2d> pixel = project(camera, p_C);
  // Integer coordinates are the centres of pixels.
  const bool is_inside = pixel && pixel->x() >= -0.5 && pixel->x() < camera.width - 0.5 &&
                         pixel->y() >= -0.5 && pixel->y() < camera.height - 0.5 &&
                         (p_C.z() <= 0 || p_C.head<2>().norm() <= p_C.z() * largest_radius(camera));
  if (!is_inside) return PlaceSight::outside;
  if (p_C.z() < field.near) return PlaceSight::too_near;
  return p_C.z() > field.far ? PlaceSight::too_far : PlaceSight::seen;
}

// The ray of the pattern that is nearest in azimuth and in elevation passes through the place.
bool meets(const ScanPattern& pattern, const Eigen::Vector3d& direction, double tolerance) {
  const double elevation = std::asin(std::clamp(direction.z(), -1.0, 1.0));
  double azimuth = std::atan2(direction.y(), direction.x());
  constexpr double kTurn = 2 * std::numbers::pi;
  if (azimuth < pattern.angle_min) azimuth += kTurn;
  const double high = std::abs(azimuth - pattern.angle_max),
               low = std::abs(azimuth - kTurn - pattern.angle_min);
  const bool is_beyond = azimuth > pattern.angle_max;
  const double beside = !is_beyond ? 0 : std::min(high, low) * std::cos(elevation);
  double ring = kTurn;
  for (const double one : pattern.elevations) ring = std::min(ring, std::abs(elevation - one));
  return std::hypot(beside, ring) <= tolerance;
}

PlaceSight by_range(const SensorField& field, double distance) {
  if (distance < field.near) return PlaceSight::too_near;
  return distance > field.far ? PlaceSight::too_far : PlaceSight::seen;
}

double angular_radius(double radius, double distance) {
  return std::asin(std::min(1.0, radius / std::max(distance, 1e-9)));
}

SensorField field_of(const RobotSensor& sensor, const CameraDescription& camera) {
  SensorField out;
  out.name = sensor.description.name;
  const bool measures = camera.kind == CameraKind::depth || camera.kind == CameraKind::rgbd;
  out.kind = measures ? "depth camera" : "camera";
  out.X_LS = sensor.description.X_LS * camera.X_SC;
  out.near = measures ? camera.depth_near.value_or(camera.near) : camera.near;
  out.far = measures ? camera.depth_far.value_or(camera.far) : camera.far;
  out.half_angle = 0.5 * camera.hfov;
  out.what = intrinsics_of(camera);
  return out;
}

SensorField field_of(const RobotSensor& sensor, const LidarDescription& lidar) {
  SensorField out;
  out.name = sensor.description.name;
  out.kind = "lidar";
  out.X_LS = sensor.description.X_LS;
  out.near = lidar.near;
  out.far = lidar.far;
  out.half_angle = 0.5 * (lidar.horizontal.max - lidar.horizontal.min);
  out.what = scan_pattern(lidar);
  return out;
}

SensorField field_of(const RobotSensor& sensor, const RangeDescription& range) {
  SensorField out;
  out.name = sensor.description.name;
  out.kind = "range sensor";
  out.X_LS = sensor.description.X_LS;
  out.near = range.near;
  out.far = range.far;
  out.half_angle = 0.5 * range.field_of_view;
  out.what = range;
  return out;
}

}  // namespace

PlaceSight SensorField::sight(const Eigen::Vector3d& p_S, double radius) const {
  if (const auto* const camera = std::get_if<CameraIntrinsics>(&what)) return sight_of(*camera, *this, p_S);
  const double distance = p_S.norm(), tolerance = angular_radius(radius, distance);
  const Eigen::Vector3d direction = distance > 0 ? Eigen::Vector3d(p_S / distance) : Eigen::Vector3d::UnitX();
  const auto* const pattern = std::get_if<ScanPattern>(&what);
  const bool is_inside = pattern != nullptr
                             ? meets(*pattern, direction, tolerance)
                             : std::acos(std::clamp(direction.x(), -1.0, 1.0)) <= half_angle + tolerance;
  return is_inside ? by_range(*this, distance) : PlaceSight::outside;
}

double SensorField::density(const Eigen::Vector3d& p_S) const {
  if (const auto* const camera = std::get_if<CameraIntrinsics>(&what)) {
    const double depth = camera->plain() ? p_S.x() : p_S.norm();
    return depth > 0 ? kPerCentimetre * camera->fx / depth : 0;
  }
  const auto* const pattern = std::get_if<ScanPattern>(&what);
  if (pattern == nullptr || pattern->angle_increment <= 0 || p_S.norm() <= 0) return 0;
  return kPerCentimetre / (pattern->angle_increment * p_S.norm());
}

std::vector<SensorField> sensor_fields(const RobotSensors& sensors, const Model& model) {
  std::vector<SensorField> out;
  for (const RobotSensor& sensor : sensors.sensors) {
    const int link = model.find_link(sensor.description.link);
    const std::size_t first = out.size();
    if (const auto* const cameras = std::get_if<std::vector<CameraDescription>>(&sensor.description.what)) {
      for (const CameraDescription& camera : *cameras) {
        out.push_back(field_of(sensor, camera));
        if (cameras->size() > 1) out.back().name += "/" + camera.name;
      }
    } else if (const auto* const lidar = std::get_if<LidarDescription>(&sensor.description.what)) {
      out.push_back(field_of(sensor, *lidar));
    } else if (const auto* const range = std::get_if<RangeDescription>(&sensor.description.what)) {
      out.push_back(field_of(sensor, *range));
    }
    for (std::size_t i = first; i < out.size(); ++i) {
      out[i].link = link;
      out[i].where = sensor.description.source;
    }
  }
  std::erase_if(out, [](const SensorField& field) { return field.link < 0; });
  return out;
}

}  // namespace doppel
