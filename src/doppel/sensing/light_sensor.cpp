#include "doppel/sensing/detail/light_sensor.h"

namespace doppel {

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
