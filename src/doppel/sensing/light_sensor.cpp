#include "doppel/sensing/detail/light_sensor.h"

namespace doppel {

std::string LightSensor::key_of(const RigSensor& sensor) {
  return sensor.instance + "/" + sensor.description.link + sensor.description.joint + "/" +
         sensor.description.name;
}

std::string LightSensor::topic_of(const std::string& output, const std::string& own) const {
  std::string topic = own;
  for (const auto& [name, given] : sensor_.description.topics)
    if (name == output) topic = given;
  if (topic.starts_with("/")) return topic;
  std::string prefix = "/";
  if (!sensor_.name_space.empty()) prefix += sensor_.name_space + "/";
  std::string inner = sensor_.description.name_space;
  while (inner.starts_with("/")) inner.erase(0, 1);
  if (!inner.empty()) prefix += inner + "/";
  return prefix + topic;
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
