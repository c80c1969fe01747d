#include "doppel/description/gazebo/sensor_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/description/gazebo/detail/sensor_kinds.h"
#include "doppel/description/gazebo/detail/sensor_plugins.h"
#include "doppel/description/gazebo/detail/sensor_presets.h"
#include "doppel/description/gazebo/detail/sensor_values.h"

namespace doppel {
namespace {

constexpr double kLargestRate = 1e9;    // Hz
constexpr double kLargestLatency = 60;  // s, because the samples of that time are kept

using Read = void (*)(const SensorValues&, SensorDescription&);
struct Kind {
  const char* type;
  Read read;            // nullptr: known, and not simulated
  const char* element;  // of its values, for presets
};

constexpr Kind kKinds[] = {
    {"camera", read_camera, "camera"},
    {"wideanglecamera", read_camera, "camera"},
    {"wide_angle_camera", read_camera, "camera"},
    {"depth", read_camera, "camera"},
    {"depth_camera", read_camera, "camera"},
    {"rgbd_camera", read_camera, "camera"},
    {"rgbd", read_camera, "camera"},
    {"segmentation", read_camera, "camera"},
    {"segmentation_camera", read_camera, "camera"},
    {"boundingbox", read_camera, "camera"},
    {"boundingbox_camera", read_camera, "camera"},
    {"multicamera", read_camera, "camera"},
    {"ray", read_lidar, "ray"},
    {"gpu_ray", read_lidar, "ray"},
    {"lidar", read_lidar, "ray"},
    {"gpu_lidar", read_lidar, "ray"},
    {"sonar", read_sonar, "sonar"},
    {"imu", read_imu, "imu"},
    {"force_torque", read_force_torque, "force_torque"},
    {"contact", read_contact, "contact"},
    {"navsat", read_environment, "navsat"},
    {"gps", read_environment, "navsat"},
    {"magnetometer", read_environment, "magnetometer"},
    {"altimeter", read_environment, "altimeter"},
    {"air_pressure", read_environment, "air_pressure"},
    {"logical_camera", read_environment, "logical_camera"},
    {"thermal", nullptr, ""},
    {"thermal_camera", nullptr, ""},
    {"air_speed", nullptr, ""},
    {"rfid", nullptr, ""},
    {"rfidtag", nullptr, ""},
    {"wireless_receiver", nullptr, ""},
    {"wireless_transmitter", nullptr, ""},
    {"dvl", nullptr, ""},
    {"custom", nullptr, ""},
};

// The kind of a type; nullptr: there is none that is simulated, which is reported.
const Kind* find_kind(const XmlNode& sensor, const SensorDescription& named, Diagnostics& diagnostics) {
  const auto* const kind = std::ranges::find(kKinds, named.type, &Kind::type);
  if (kind != std::end(kKinds) && kind->read != nullptr) return kind;
  if (kind != std::end(kKinds)) {
    diagnostics.warning(
        "sensor.type", sensor.where,
        fmt::format("the sensor '{}' publishes nothing: sensors of the type '{}' are not simulated",
                    named.name, named.type));
    return nullptr;
  }
  std::vector<std::string> types;
  for (const Kind& one : kKinds) types.emplace_back(one.type);
  const std::optional<std::string> near = nearest_name(named.type, types);
  diagnostics.warning(
      "sensor.type", sensor.where,
      fmt::format("the sensor '{}' has the unknown type '{}' and publishes nothing{}", named.name, named.type,
                  near ? fmt::format("; did you mean '{}'?", *near) : ""));
  return nullptr;
}

// The link that no joint carries.
std::string root_of(const RobotDescription& robot) {
  for (const Link& link : robot.links)
    if (std::ranges::none_of(robot.joints, [&](const Joint& joint) { return joint.child == link.name; }))
      return link.name;
  return "";
}

// Sensors of one <gazebo>, and plugins in it that are sensors.
class ExtensionReader {
 public:
  ExtensionReader(const RobotDescription& robot, Diagnostics& diagnostics,
                  std::vector<SensorDescription>& out)
      : robot_(robot), diagnostics_(diagnostics), out_(out) {}

  void read(const GazeboExtension& extension) {
    for (const XmlNode& child : extension.node->children) {
      if (child.is("sensor")) read_inner(child, extension.reference);
      if (child.is("plugin")) add(read_outer_plugin(child, robot_, extension.reference, diagnostics_));
    }
  }

 private:
  void read_inner(const XmlNode& sensor, const std::string& reference) {
    const Joint* const joint = robot_.find_joint(reference);
    std::string link = joint != nullptr ? joint->child : reference;
    if (reference.empty()) {
      link = root_of(robot_);
      diagnostics_.note(
          "sensor.reference", sensor.where,
          fmt::format("the sensor is in a <gazebo> without a reference, where Gazebo has no sensors; "
                      "it is on the root link '{}'",
                      link),
          "write <gazebo reference=\"LINK\">");
    }
    if (robot_.find_link(link) == nullptr) {
      std::vector<std::string> names;
      for (const Link& one : robot_.links) names.push_back(one.name);
      diagnostics_.warning(
          "sensor.reference", sensor.where,
          fmt::format("the sensor is on '{}', which is neither a link nor a joint; it is left out{}",
                      reference, did_you_mean(reference, names)));
      return;
    }
    std::optional<SensorDescription> out = read_sensor(sensor, link, diagnostics_);
    if (out && joint != nullptr) out->joint = joint->name;
    add(std::move(out));
  }

  void add(std::optional<SensorDescription> sensor) {
    if (!sensor) return;
    const auto same = [&](const SensorDescription& one) {
      return one.name == sensor->name && one.link == sensor->link && one.joint == sensor->joint;
    };
    if (std::ranges::any_of(out_, same)) {
      const std::string name = sensor->name;
      for (int i = 2; std::ranges::any_of(out_, same); ++i) sensor->name = fmt::format("{}_{}", name, i);
      diagnostics_.warning(
          "sensor.name", sensor->source,
          fmt::format("'{}' has two sensors '{}'; the second is '{}'", sensor->link, name, sensor->name),
          "give each its own name");
    }
    out_.push_back(std::move(*sensor));
  }

  const RobotDescription& robot_;
  Diagnostics& diagnostics_;
  std::vector<SensorDescription>& out_;
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
  const Kind* const kind = find_kind(sensor, out, diagnostics);
  if (kind == nullptr) return std::nullopt;
  const SensorValues values(sensor, diagnostics, find_preset(sensor, kind->element, diagnostics));
  out.X_LS = values.pose("pose");
  out.rate = std::clamp(values.number("update_rate", 0), 0.0, kLargestRate);
  out.latency = values.within("doppel:latency", 0, 0, kLargestLatency);
  out.topic = values.text("topic");
  if (out.topic.starts_with("__default")) out.topic.clear();  // as sdformat writes it: none
  out.visualize = values.flag("visualize", false);
  for (const char* tag : {"optical_frame_id", "frame_id"})
    if (out.frame.empty() && values.has(tag)) {
      out.frame = values.text(tag);
      out.frame_is_optical = std::string_view(tag) == "optical_frame_id";
    }
  kind->read(values, out);
  for (const XmlNode& child : sensor.children)
    if (child.is("plugin")) read_inner_plugin(child, out, diagnostics);
  check_lenses(values, out);
  return out;
}

std::vector<SensorDescription> read_sensors(const RobotDescription& robot, Diagnostics& diagnostics) {
  std::vector<SensorDescription> out;
  ExtensionReader reader(robot, diagnostics, out);
  for (const GazeboExtension& extension : robot.gazebo)
    if (extension.node != nullptr) reader.read(extension);
  return out;
}

}  // namespace doppel
