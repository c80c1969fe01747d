#include "doppel/sensors/models/reading_names.h"

namespace doppel {

std::vector<std::string> reading_names(const SensorDescription& sensor) {
  if (std::holds_alternative<ImuDescription>(sensor.what))
    return {"orientation.x",         "orientation.y",        "orientation.z",      "orientation.w",
            "angular_velocity.x",    "angular_velocity.y",   "angular_velocity.z", "linear_acceleration.x",
            "linear_acceleration.y", "linear_acceleration.z"};
  if (std::holds_alternative<ForceTorqueDescription>(sensor.what))
    return {"force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z"};
  if (std::holds_alternative<RangeDescription>(sensor.what)) return {"range"};
  const auto* const environment = std::get_if<EnvironmentDescription>(&sensor.what);
  if (environment == nullptr) return {};
  switch (environment->kind) {
    case EnvironmentKind::navsat:
      return {"status",
              "service",
              "latitude",
              "longitude",
              "altitude",
              "latitude_covariance",
              "longitude_covariance",
              "altitude_covariance"};
    case EnvironmentKind::magnetometer:
      return {"magnetic_field.x", "magnetic_field.y", "magnetic_field.z"};
    case EnvironmentKind::altimeter:
      return {"vertical_position", "vertical_velocity", "vertical_reference"};
    case EnvironmentKind::air_pressure:
      return {"fluid_pressure", "variance"};
    case EnvironmentKind::pose:
      return {"position.x",    "position.y",    "position.z",   "orientation.x",
              "orientation.y", "orientation.z", "orientation.w"};
    case EnvironmentKind::logical_camera:
      break;
  }
  return {};
}

}  // namespace doppel
