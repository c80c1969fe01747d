#include "doppel/sensors/rigs/detail/light_sensor.h"

#include <string>

#include "doppel/base/core/diagnostic.h"

namespace doppel {

void LightSensor::check_outlets() const {
  if (outlets_.size() < kMaxOutlets) return;
  throw InputError(
      "sensors.outputs", sensor_.description.source,
      "the sensor '" + sensor_key(sensor_) + "' has more than " + std::to_string(kMaxOutlets) + " outputs",
      "divide its cameras among several <sensor> elements");
}

std::unique_ptr<LightSensor> make_light_sensor(Node& node, const RigSensor& sensor,
                                               const RigOptions& options) {
  const auto& what = sensor.description.what;
  if (std::holds_alternative<std::vector<CameraDescription>>(what))
    return make_camera_output(node, sensor, options);
  if (std::holds_alternative<LidarDescription>(what)) return make_lidar_output(node, sensor, options);
  if (std::holds_alternative<RangeDescription>(what)) return make_range_output(node, sensor, options);
  return nullptr;
}

}  // namespace doppel
