#include "doppel/description/gazebo/detail/sensor_plugins.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/base/xml/element.h"
#include "doppel/description/gazebo/plugin_values.h"
#include "doppel/description/gazebo/sensor_reader.h"

namespace doppel {
namespace {

constexpr const char* kRule = "sensor.plugin";
constexpr double kNoDistortion = 1e-6;  // files write 0.00000001 for none

// A plugin with the sensor that it belongs to.
struct SensorPluginReader {
  PluginValues values;
  SensorDescription& sensor;
  bool ros1 = false;  // its elements are in camel case
};
using ReadPlugin = void (*)(SensorPluginReader&);

bool is_camel_case(const std::string& name) {
  for (std::size_t i = 1; i < name.size(); ++i)
    if (name[i - 1] >= 'a' && name[i - 1] <= 'z' && name[i] >= 'A' && name[i] <= 'Z') return true;
  return false;
}

bool is_ros1(const XmlNode& plugin) {
  return plugin.first("ros") == nullptr &&
         std::ranges::any_of(plugin.children, [](const XmlNode& child) { return is_camel_case(child.name); });
}

std::string below(const std::string& name, const std::string& topic) {
  return name.empty() || topic.starts_with('/') ? topic : name + "/" + topic;
}

bool wants_best_effort(const XmlNode& plugin) {
  const XmlNode* const ros = plugin.first("ros");
  const XmlNode* const qos = ros == nullptr ? nullptr : ros->first("qos");
  if (qos == nullptr) return false;
  return std::ranges::any_of(qos->children, [](const XmlNode& topic) {
    const XmlNode* const publisher = topic.first("publisher");
    const XmlNode* const kind = publisher == nullptr ? nullptr : publisher->first("reliability");
    return kind != nullptr && kind->content() == "best_effort";
  });
}

// Reads the values that all of them have: namespace, frame, rate, quality of service.
void read_common(SensorPluginReader& in) {
  PluginValues& values = in.values;
  in.sensor.name_space = values.ros_namespace();
  in.sensor.best_effort = wants_best_effort(values.element());
  std::string frame = values.text({"frame_name", "frameName", "frameId", "frame_id"});
  while (frame.starts_with('/')) frame.erase(0, 1);  // as in tf of ROS 1
  if (!frame.empty() && frame != "world" && frame != "map") {
    in.sensor.frame = frame;
    in.sensor.frame_is_optical = false;
  }
  const double rate = values.number({"update_rate", "updateRate", "updateRateHZ"}).value_or(0);
  if (rate > 0 && (in.sensor.rate <= 0 || rate < in.sensor.rate)) in.sensor.rate = rate;
  values.flag({"alwaysOn", "always_on"}, true);
}

// The only topic, by its name of ROS 1, or that of ROS 2 with its <remapping>.
void set_topic(SensorPluginReader& in, std::initializer_list<std::string_view> tags, const std::string& ros1,
               const std::string& ros2) {
  in.sensor.topic = in.ros1 ? in.values.text(tags, ros1) : in.values.remapped(ros2);
}

// -- cameras

// The noise-free distortion of a plugin of ROS 1 stands in camera_info; the pictures must have it too.
void set_distortion(SensorPluginReader& in, CameraDescription& camera) {
  constexpr std::array kNames{"distortionK1", "distortionK2", "distortionT1", "distortionT2", "distortionK3"};
  constexpr std::array kNames2{"distortion_k1", "distortion_k2", "distortion_t1", "distortion_t2",
                               "distortion_k3"};
  std::array<double, 5> given{};
  bool any = false;
  for (std::size_t i = 0; i < given.size(); ++i) {
    given[i] = in.values.number({kNames[i], kNames2[i]}).value_or(0);
    any = any || std::abs(given[i]) > kNoDistortion;
  }
  const auto& own = camera.lens.distortion;
  if (any && std::ranges::all_of(own, [](double k) { return k == 0; })) camera.lens.distortion = given;
}

void set_baselines(SensorPluginReader& in, std::vector<CameraDescription>& cameras) {
  const auto given = in.values.number({"hack_baseline", "hackBaseline"});
  if (!given) return;
  // The first of several is the left one, to which the others are compared.
  for (std::size_t i = cameras.size() > 1 ? 1 : 0; i < cameras.size(); ++i) cameras[i].baseline = *given;
}

std::string camera_name_of(SensorPluginReader& in) {
  return in.values.text({"camera_name", "cameraName"}, in.ros1 ? "" : in.sensor.name);
}

void set_camera_topics(SensorPluginReader& in, const std::string& name, const std::string& prefix,
                       const std::string& picture, const std::string& info) {
  auto& topics = in.sensor.topics;
  const std::string image = below(name, in.values.text({"imageTopicName"}, picture));
  const std::string about = below(name, in.values.text({"cameraInfoTopicName"}, info));
  topics.emplace_back(prefix + "image", in.values.remapped(image));
  topics.emplace_back(prefix + "camera_info", in.values.remapped(about));
}

void set_depth_topics(SensorPluginReader& in, const std::string& name) {
  const auto add = [&](const char* output, const char* tag, const char* otherwise) {
    in.sensor.topics.emplace_back(output, in.values.remapped(below(name, in.values.text({tag}, otherwise))));
  };
  add("depth", "depthImageTopicName", "depth/image_raw");
  add("depth_camera_info", "depthImageCameraInfoTopicName", "depth/camera_info");
  add("points", "pointCloudTopicName", "points");
}

void read_depth(SensorPluginReader& in, std::vector<CameraDescription>& cameras) {
  const auto near = in.values.number({"min_depth", "pointCloudCutoff"});
  const auto far = in.values.number({"max_depth", "pointCloudCutoffMax"});
  for (CameraDescription& camera : cameras) {
    camera.kind = CameraKind::rgbd;
    camera.depth_near = near.value_or(0.4);
    if (far || in.ros1) camera.depth_far = far.value_or(5.0);
  }
}

void read_camera_plugin(SensorPluginReader& in, bool depth) {
  auto& cameras = std::get<std::vector<CameraDescription>>(in.sensor.what);
  const bool pictures = std::ranges::all_of(
      cameras, [](const CameraDescription& camera) { return camera.kind == CameraKind::colour; });
  const std::string name = camera_name_of(in);
  if (depth || !pictures) read_depth(in, cameras);
  const bool infrared = depth && in.ros1;
  const char* const picture = infrared ? "ir/image_raw" : "image_raw";
  const char* const info = infrared ? "ir/camera_info" : "camera_info";
  if (cameras.size() == 1) {
    set_camera_topics(in, name, "", picture, info);
    if (depth || !pictures) set_depth_topics(in, name);
  } else {
    for (const CameraDescription& camera : cameras)
      set_camera_topics(in, below(name, camera.name), camera.name + "/", picture, info);
  }
  set_baselines(in, cameras);
  for (CameraDescription& camera : cameras) set_distortion(in, camera);
}

void read_picture_plugin(SensorPluginReader& in) {
  read_camera_plugin(in, false);
}
void read_depth_plugin(SensorPluginReader& in) {
  read_camera_plugin(in, true);
}

// -- lidars

void read_scan_noise(SensorPluginReader& in) {
  const double stddev = in.values.number({"gaussianNoise", "gaussian_noise"}).value_or(0);
  auto& lidar = std::get<LidarDescription>(in.sensor.what);
  if (stddev > 0 && !lidar.noise.any()) lidar.noise.stddev = stddev;
  lidar.intensity_minimum = in.values.number({"min_intensity", "hokuyoMinIntensity"}).value_or(0);
}

void read_laser_plugin(SensorPluginReader& in) {
  set_topic(in, {"topicName"}, in.sensor.name, "~/out");
  read_scan_noise(in);
}

void read_points_plugin(SensorPluginReader& in) {
  read_laser_plugin(in);
  auto& lidar = std::get<LidarDescription>(in.sensor.what);
  lidar.near = in.values.number({"min_range"}).value_or(lidar.near);
  lidar.far = in.values.number({"max_range"}).value_or(lidar.far);
  in.sensor.points_only = true;
}

// The rays of a scan as the one distance of a range sensor.
void make_range(SensorPluginReader& in, const char* radiation) {
  const LidarDescription rays = std::get<LidarDescription>(in.sensor.what);
  const std::string kind = in.values.text({"radiation_type", "radiation"}, radiation);
  RangeDescription range;
  const double width = rays.horizontal.max - rays.horizontal.min,
               height = rays.vertical.max - rays.vertical.min;
  range.field_of_view = in.values.number({"fov"}).value_or(std::max(width, height));
  range.near = rays.near;
  range.far = rays.far;
  range.ultrasound = lowered(kind) == "ultrasound";
  range.rays = rays;
  in.sensor.what = range;
}

void read_range_plugin(SensorPluginReader& in) {
  set_topic(in, {"topicName"}, "range", "~/out");
  read_scan_noise(in);
  make_range(in, "ultrasound");
}

void read_ray_plugin(SensorPluginReader& in) {
  set_topic(in, {"topicName"}, in.sensor.name, "~/out");
  read_scan_noise(in);
  const std::string output = in.values.text({"output_type"}, "sensor_msgs/PointCloud2");
  if (output.ends_with("Range")) return make_range(in, "infrared");
  in.sensor.points_only = output.find("PointCloud") != std::string::npos;
}

// -- physical sensors

void set_noise(NoiseDescription& noise, double stddev) {
  if (stddev > 0 && !noise.any()) noise.stddev = stddev;
}

void read_imu_plugin(SensorPluginReader& in) {
  auto& imu = std::get<ImuDescription>(in.sensor.what);
  set_topic(in, {"topicName"}, "imu", "~/out");
  const bool start =
      in.values.flag({"initial_orientation_as_reference", "initialOrientationAsReference"}, true);
  imu.reference = start ? OrientationReference::start : OrientationReference::world_enu;
  const double stddev = in.values.number({"gaussianNoise", "gaussian_noise"}).value_or(0);
  // One number, or one for each axis, as hector's plugins have them.
  const auto for_axis = [&](const char* tag, std::size_t axis) {
    const std::vector<double> given = in.values.numbers({tag});
    return given.size() == 3 ? given[axis] : given.size() == 1 ? given[0] : stddev;
  };
  for (std::size_t i = 0; i < 3; ++i) {
    set_noise(imu.angular_velocity[i], for_axis("rateGaussianNoise", i));
    set_noise(imu.linear_acceleration[i], for_axis("accelGaussianNoise", i));
  }
  set_noise(imu.orientation, in.values.number({"yawGaussianNoise"}).value_or(stddev));
}

// Those that are a plugin of the model measure the true orientation.
void read_body_imu_plugin(SensorPluginReader& in) {
  read_imu_plugin(in);
  std::get<ImuDescription>(in.sensor.what).reference = OrientationReference::world_enu;
}

void read_wrench_plugin(SensorPluginReader& in) {
  auto& wrench = std::get<ForceTorqueDescription>(in.sensor.what);
  set_topic(in, {"topicName"}, "wrench", "wrench");
  const double stddev = in.values.number({"gaussianNoise", "gaussian_noise"}).value_or(0);
  for (std::size_t i = 0; i < 3; ++i) {
    set_noise(wrench.force[i], stddev);
    set_noise(wrench.torque[i], stddev);
  }
}

void read_bumper_plugin(SensorPluginReader& in) {
  set_topic(in, {"bumperTopicName"}, "bumper_states", "bumper_states");
  std::get<ContactDescription>(in.sensor.what).bumper = true;
}

void read_position_plugin(SensorPluginReader& in) {
  set_topic(in, {"topicName"}, "fix", "~/out");
}

void read_field_plugin(SensorPluginReader& in) {
  set_topic(in, {"topicName"}, "magnetic", "~/out");
}

// -- the table

enum class Needs { camera, lidar, imu, wrench, contact, environment };

struct KnownSensorPlugin {
  const char* name;  // of the file, without "lib" and ".so"
  Needs needs;
  ReadPlugin read;
  const char* type = "";  // of the sensor that it is outside of one; empty: none
};

constexpr KnownSensorPlugin kSensorPlugins[] = {
    {"gazebo_ros_camera", Needs::camera, read_picture_plugin},
    {"gazebo_ros_multicamera", Needs::camera, read_picture_plugin},
    {"gazebo_ros_triggered_camera", Needs::camera, read_picture_plugin},
    {"gazebo_ros_triggered_multicamera", Needs::camera, read_picture_plugin},
    {"gazebo_ros_prosilica", Needs::camera, read_picture_plugin},
    {"gazebo_ros_depth_camera", Needs::camera, read_depth_plugin},
    {"gazebo_ros_openni_kinect", Needs::camera, read_depth_plugin},
    {"gazebo_ros_laser", Needs::lidar, read_laser_plugin},
    {"gazebo_ros_gpu_laser", Needs::lidar, read_laser_plugin},
    {"gazebo_ros_ray_sensor", Needs::lidar, read_ray_plugin},
    {"gazebo_ros_block_laser", Needs::lidar, read_points_plugin},
    {"gazebo_ros_velodyne_laser", Needs::lidar, read_points_plugin},
    {"gazebo_ros_velodyne_gpu_laser", Needs::lidar, read_points_plugin},
    {"gazebo_ros_range", Needs::lidar, read_range_plugin},
    {"hector_gazebo_ros_sonar", Needs::lidar, read_range_plugin},
    {"gazebo_ros_imu_sensor", Needs::imu, read_imu_plugin},
    {"gazebo_ros_imu", Needs::imu, read_body_imu_plugin, "imu"},
    {"hector_gazebo_ros_imu", Needs::imu, read_body_imu_plugin, "imu"},
    {"gazebo_ros_ft_sensor", Needs::wrench, read_wrench_plugin, "force_torque"},
    {"gazebo_ros_bumper", Needs::contact, read_bumper_plugin},
    {"gazebo_ros_gps_sensor", Needs::environment, read_position_plugin},
    {"hector_gazebo_ros_gps", Needs::environment, read_position_plugin, "navsat"},
    {"hector_gazebo_ros_magnetic", Needs::environment, read_field_plugin, "magnetometer"},
};

std::string plugin_attribute(const XmlNode& node, const char* name) {
  const XmlAttribute* const found = node.find(name);
  return found == nullptr ? "" : found->value;
}

// "gazebo_ros_camera" for "libgazebo_ros_camera.so".
std::string stem_of(const XmlNode& plugin) {
  std::string name = plugin_attribute(plugin, "filename");
  if (const std::size_t slash = name.rfind('/'); slash != std::string::npos) name.erase(0, slash + 1);
  if (name.starts_with("lib")) name.erase(0, 3);
  if (name.ends_with(".so")) name.erase(name.size() - 3);
  return name;
}

const KnownSensorPlugin* find_plugin(const std::string& stem) {
  const auto* const found = std::ranges::find(kSensorPlugins, stem, &KnownSensorPlugin::name);
  return found == std::end(kSensorPlugins) ? nullptr : found;
}

bool fits(const KnownSensorPlugin& plugin, const SensorDescription& sensor) {
  switch (plugin.needs) {
    case Needs::camera:
      return std::holds_alternative<std::vector<CameraDescription>>(sensor.what);
    case Needs::lidar:
      return std::holds_alternative<LidarDescription>(sensor.what);
    case Needs::imu:
      return std::holds_alternative<ImuDescription>(sensor.what);
    case Needs::wrench:
      return std::holds_alternative<ForceTorqueDescription>(sensor.what);
    case Needs::contact:
      return std::holds_alternative<ContactDescription>(sensor.what);
    case Needs::environment:
      return std::holds_alternative<EnvironmentDescription>(sensor.what);
  }
  return false;
}

bool says_nothing(const XmlNode& value) {
  const std::string text = value.content();
  return text.empty() || text == "0" || text == "0.0" || text == "false" || text == "0 0 0" ||
         text == "0.0 0.0 0.0";
}

void report_unread(SensorPluginReader& in, const XmlNode& plugin, Diagnostics& diagnostics) {
  std::vector<std::string> unread = in.values.unread();
  std::erase_if(unread, [&](const std::string& name) { return says_nothing(*plugin.first(name)); });
  const std::string whose =
      fmt::format("the plugin '{}' of the sensor '{}'", stem_of(plugin), in.sensor.name);
  in.values.report_wrong(kRule, plugin.where, whose, diagnostics);
  if (!unread.empty())
    diagnostics.note(kRule, plugin.where,
                     fmt::format("{} is read; without effect: {}", whose, fmt::join(unread, ", ")));
  for (const std::string& rule : in.values.unused_remappings())
    diagnostics.note(
        kRule, plugin.where,
        fmt::format("{} has no topic that its <remapping>{}</remapping> applies to", whose, rule),
        "write the topic as the plugin names it, for example camera_name/image_raw or ~/out");
}

void apply(const KnownSensorPlugin& known, const XmlNode& plugin, SensorDescription& sensor,
           Diagnostics& diagnostics) {
  SensorPluginReader in{PluginValues(plugin), sensor, is_ros1(plugin)};
  read_common(in);
  if (!*known.type) {
    in.values.text({"bodyName", "body_name"});  // the sensor has its link
  }
  known.read(in);
  report_unread(in, plugin, diagnostics);
}

// Of a plugin outside of a sensor.
void place_on(const std::string& name, const std::string& joint, PluginValues& values,
              SensorDescription& out) {
  out.link = name;
  out.joint = joint;
  const auto triple = [&](std::initializer_list<std::string_view> tags) {
    const std::vector<double> n = values.numbers(tags);
    return n.size() == 3 ? Eigen::Vector3d(n[0], n[1], n[2]) : Eigen::Vector3d(0, 0, 0);
  };
  out.X_LS = make_pose(triple({"xyzOffset", "xyz_offset", "xyzOffsets"}),
                       triple({"rpyOffset", "rpy_offset", "rpyOffsets"}));
}

}  // namespace

void read_inner_plugin(const XmlNode& plugin, SensorDescription& sensor, Diagnostics& diagnostics) {
  const std::string stem = stem_of(plugin);
  const KnownSensorPlugin* const known = find_plugin(stem);
  if (known == nullptr) {
    std::vector<std::string> names;
    for (const KnownSensorPlugin& one : kSensorPlugins) names.emplace_back(one.name);
    const auto near = nearest_name(stem, names);
    diagnostics.note(
        kRule, plugin.where,
        fmt::format("the plugin '{}' of the sensor '{}' is not known; the sensor publishes as without it{}",
                    plugin_attribute(plugin, "filename"), sensor.name,
                    near ? fmt::format("; did you mean '{}'?", *near) : ""));
    return;
  }
  if (!fits(*known, sensor)) {
    diagnostics.warning(
        kRule, plugin.where,
        fmt::format("the plugin '{}' does not fit the sensor '{}' of the type '{}'; it has no effect", stem,
                    sensor.name, sensor.type),
        "correct the type of the sensor, or use the plugin for that type");
    return;
  }
  apply(*known, plugin, sensor, diagnostics);
}

std::optional<SensorDescription> read_outer_plugin(const XmlNode& plugin, const RobotDescription& robot,
                                                   const std::string& reference, Diagnostics& diagnostics) {
  const KnownSensorPlugin* const known = find_plugin(stem_of(plugin));
  if (known == nullptr || !*known->type) return std::nullopt;
  PluginValues values(plugin);
  const std::string joint_name = values.text({"jointName", "joint_name"});
  const Joint* const joint = joint_name.empty() ? nullptr : robot.find_joint(joint_name);
  const std::string body = values.text({"bodyName", "body_name"}, reference);
  const std::string link = joint != nullptr ? joint->child : body;
  const std::string name = plugin_attribute(plugin, "name");
  if (robot.find_link(link) == nullptr) {
    std::vector<std::string> names;
    for (const Link& one : robot.links) names.push_back(one.name);
    for (const Joint& one : robot.joints) names.push_back(one.name);
    const std::string wanted = joint_name.empty() ? body : joint_name;
    diagnostics.warning(
        "sensor.reference", plugin.where,
        fmt::format("the plugin '{}' names '{}', which is neither a link nor a joint; it publishes nothing{}",
                    name, wanted, did_you_mean(wanted, names)),
        known->needs == Needs::wrench ? "name a joint in <joint_name>" : "name a link in <bodyName>");
    return std::nullopt;
  }
  XmlNode bare = element("sensor", {{"name", name}, {"type", known->type}});
  bare.where = plugin.where;
  std::optional<SensorDescription> out = read_sensor(bare, link, diagnostics);
  if (!out) return out;
  // The offsets and bodies are read here; apply() reads the others and reports what is left.
  XmlNode rest = plugin;
  std::erase_if(rest.children, [](const XmlNode& child) {
    return child.name.ends_with("Name") ? child.is("bodyName") || child.is("jointName")
                                        : child.is("body_name") || child.is("joint_name") ||
                                              child.name.starts_with("xyz") || child.name.starts_with("rpy");
  });
  place_on(link, joint == nullptr ? "" : joint->name, values, *out);
  apply(*known, rest, *out, diagnostics);
  return out;
}

}  // namespace doppel
