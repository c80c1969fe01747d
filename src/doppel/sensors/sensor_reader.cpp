#include "doppel/sensors/sensor_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/core/names.h"
#include "doppel/sensors/detail/sensor_kinds.h"
#include "doppel/sensors/detail/sensor_values.h"

namespace doppel {
namespace {

using Read = void (*)(const SensorValues&, SensorDescription&);
struct Kind {
  const char* type;
  Read read;
};

constexpr Kind kKinds[] = {
    {"camera", read_camera},
    {"wideanglecamera", read_camera},
    {"wide_angle_camera", read_camera},
    {"depth", read_camera},
    {"depth_camera", read_camera},
    {"rgbd_camera", read_camera},
    {"rgbd", read_camera},
    {"segmentation", read_camera},
    {"segmentation_camera", read_camera},
    {"boundingbox", read_camera},
    {"boundingbox_camera", read_camera},
    {"multicamera", read_camera},
    {"ray", read_lidar},
    {"gpu_ray", read_lidar},
    {"lidar", read_lidar},
    {"gpu_lidar", read_lidar},
    {"sonar", read_sonar},
    {"imu", read_imu},
    {"force_torque", read_force_torque},
    {"contact", read_contact},
    {"navsat", read_environment},
    {"gps", read_environment},
    {"magnetometer", read_environment},
    {"altimeter", read_environment},
    {"air_pressure", read_environment},
    {"logical_camera", read_environment},
};

}  // namespace

std::optional<SensorDescription> read_sensor(const XmlNode& sensor, const std::string& link,
                                             Diagnostics& diagnostics) {
  const XmlAttribute* type = sensor.find("type");
  const XmlAttribute* name = sensor.find("name");
  SensorDescription out;
  out.type = type == nullptr ? "" : type->value;
  out.name = name == nullptr || name->value.empty() ? link + "_" + out.type : name->value;
  out.link = link;
  out.source = sensor.where;
  const auto* kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                  [&](const Kind& one) { return out.type == one.type; });
  if (kind == std::end(kKinds)) {
    std::vector<std::string> types;
    for (const Kind& one : kKinds) types.emplace_back(one.type);
    const std::optional<std::string> near = nearest_name(out.type, types);
    diagnostics.warning(
        "sensor.type", sensor.where,
        fmt::format("the sensor '{}' has the unknown type '{}' and publishes nothing{}", out.name, out.type,
                    near ? fmt::format("; did you mean '{}'?", *near) : ""));
    return std::nullopt;
  }
  const SensorValues values(sensor, diagnostics);
  out.X_LS = values.pose("pose");
  out.rate = std::max(0.0, values.number("update_rate", 0));
  out.latency = std::max(0.0, values.number("doppel:latency", 0));
  out.topic = values.text("topic");
  out.visualize = values.flag("visualize", false);
  for (const char* tag : {"optical_frame_id", "gz_frame_id", "ignition_frame_id", "frame_id"})
    if (out.frame.empty() && values.has(tag)) {
      out.frame = values.text(tag);
      out.frame_is_optical = std::string_view(tag) == "optical_frame_id";
    }
  kind->read(values, out);
  return out;
}

std::vector<SensorDescription> read_sensors(const RobotDescription& robot, Diagnostics& diagnostics) {
  std::vector<SensorDescription> out;
  for (const GazeboExtension& extension : robot.gazebo) {
    if (extension.reference.empty() || extension.xml.find("<sensor") == std::string::npos) continue;
    const XmlNode element = parse_xml(extension.xml, extension.source.str());
    const Joint* joint = robot.find_joint(extension.reference);
    const std::string link = joint != nullptr ? joint->child : extension.reference;
    for (const XmlNode& child : element.children) {
      if (!child.is("sensor")) continue;
      if (robot.find_link(link) == nullptr) {
        diagnostics.warning(
            "sensor.reference", extension.source,
            fmt::format("the sensor is on '{}', which is neither a link nor a joint; it is left out",
                        extension.reference));
        break;
      }
      std::optional<SensorDescription> sensor = read_sensor(child, link, diagnostics);
      if (!sensor) continue;
      sensor->source = extension.source;
      if (joint != nullptr) sensor->joint = joint->name;
      out.push_back(std::move(*sensor));
    }
  }
  return out;
}

}  // namespace doppel
