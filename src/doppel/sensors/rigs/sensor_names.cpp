#include "doppel/sensors/rigs/detail/sensor_names.h"

#include "doppel/sensors/rigs/pose_messages.h"
#include "doppel/sensors/rigs/range_values.h"

namespace doppel {

std::string sensor_key(const RigSensor& sensor) {
  const SensorDescription& of = sensor.description;
  return sensor.instance + "/" + (of.joint.empty() ? of.link : of.joint) + "/" + of.name;
}

std::string sensor_topic(const RigSensor& sensor, const std::string& output, const std::string& own) {
  std::string topic = own;
  for (const auto& [name, given] : sensor.description.topics)
    if (name == output) topic = given;
  if (topic.starts_with("/")) return topic;
  std::string prefix = "/";
  if (!sensor.name_space.empty()) prefix += sensor.name_space + "/";
  std::string inner = sensor.description.name_space;
  while (inner.starts_with("/")) inner.erase(0, 1);
  if (!inner.empty()) prefix += inner + "/";
  return prefix + topic;
}

doppel_msgs::msg::Sensor listed(const RigSensor& sensor) {
  doppel_msgs::msg::Sensor out;
  out.name = sensor_key(sensor);
  out.type = sensor.description.type;
  out.frame = sensor.frame;
  out.rate = sensor.description.rate;
  out.revision = sensor.revision;
  out.origin_frame = sensor.origin_frame;
  out.origin = to_point_msg(sensor.origin);
  return out;
}

std::shared_ptr<RangeValues::Value> RangeValues::of(const RigSensor& sensor) {
  std::shared_ptr<Value>& value = values_[sensor_key(sensor)];
  if (!value) value = std::make_shared<Value>();
  return value;
}

}  // namespace doppel
