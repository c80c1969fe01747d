// The values of presets as the elements that a user would write, so that they are read as those are.
#include "doppel/description/gazebo/detail/sensor_presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "doppel/base/core/names.h"

namespace doppel {
namespace {

struct Preset {
  const char* name;
  const char* element;  // of the sensors that it is for
  const char* xml;
};

// Sources, line by line of a preset:
// realsense_d435: Intel RealSense D400 series datasheet 337029, depth module D430: field of view 87 x 58 degrees, 848 x
//   480 at 30 Hz, 0.2 to 10 m, baseline 50 mm. Depth noise: Intel, "Tuning depth cameras for best performance": sigma = z^2 s
//   / (f B) with a subpixel error s = 0.08, f = 848 / (2 tan(43.5 deg)) = 446.8 pixels.
// kinect_v1: 57 x 43 degrees, 640 x 480 at 30 Hz, 0.5 to 5 m; sigma = 1.425e-3 z^2: Khoshelham and Elberink, "Accuracy and
//   resolution of Kinect depth data for indoor mapping applications", Sensors 12 (2012), eq. 10, table 1.
// rplidar_a1: Slamtec RPLIDAR A1M8 datasheet, rev. 2.1 or later: 360 degrees, 1 degree and 5.5 Hz typical, 0.15 to 12 m, 1 %
//   up to 3 m; read as three standard deviations there.
// sick_lms200: SICK LMS200 technical description 8008970: 180 degrees in steps of 1, 75 Hz, 8 m in mm mode, resolution 10 mm,
//   statistical error (1 sigma) 5 mm up to 8 m, systematic error 15 mm; read as three standard deviations.
// hokuyo_urg04lx: Hokuyo URG-04LX specification C-42-3389: 682 steps of 360/1024 degrees, 10 Hz, 0.02 to 4.095 m, resolution
//   1 mm, +-10 mm up to 1 m; read as three standard deviations.
// bno055: Bosch BST-BNO055-DS000: 100 Hz fusion; noise densities 150 ug/sqrt(Hz) at 62.5 Hz and 0.014 deg/s/sqrt(Hz) at 32 Hz;
//   steps of 0.01 m/s^2 and 1/900 rad/s.
constexpr Preset kPresets[] = {
    {"realsense_d435", "camera",
     "<preset><update_rate>30</update_rate><camera><horizontal_fov>1.518436</horizontal_fov>"
     "<image><width>848</width><height>480</height></image>"
     "<depth_camera><clip><near>0.2</near><far>10</far></clip></depth_camera></camera>"
     "<doppel:depth_noise><c>0.00358</c></doppel:depth_noise></preset>"},
    {"kinect_v1", "camera",
     "<preset><update_rate>30</update_rate><camera><horizontal_fov>0.994838</horizontal_fov>"
     "<image><width>640</width><height>480</height></image>"
     "<depth_camera><clip><near>0.5</near><far>5</far></clip></depth_camera></camera>"
     "<doppel:depth_noise><c>0.001425</c></doppel:depth_noise></preset>"},
    {"rplidar_a1", "ray",
     "<preset><update_rate>5.5</update_rate><ray><scan><horizontal><samples>360</samples>"
     "<min_angle>-3.141592653589793</min_angle><max_angle>3.12413936106985</max_angle>"
     "</horizontal></scan><range><min>0.15</min><max>12</max></range>"
     "<noise><type>gaussian</type><stddev>0.01</stddev></noise></ray></preset>"},
    {"sick_lms200", "ray",
     "<preset><update_rate>75</update_rate><ray><scan><horizontal><samples>181</samples>"
     "<min_angle>-1.5707963267948966</min_angle><max_angle>1.5707963267948966</max_angle>"
     "</horizontal></scan><range><min>0.1</min><max>8.191</max><resolution>0.01</resolution></range>"
     "<noise><type>gaussian</type><stddev>0.005</stddev><bias_stddev>0.005</bias_stddev></noise>"
     "</ray></preset>"},
    {"hokuyo_urg04lx", "ray",
     "<preset><update_rate>10</update_rate><ray><scan><horizontal><samples>682</samples>"
     "<min_angle>-2.0892818</min_angle><max_angle>2.0892818</max_angle>"
     "</horizontal></scan><range><min>0.02</min><max>4.095</max><resolution>0.001</resolution></range>"
     "<noise><type>gaussian</type><stddev>0.0033</stddev></noise></ray></preset>"},
    {"bno055", "imu", ""},  // made of two lines for three axes each
};

std::string bno055() {
  std::string out = "<preset><update_rate>100</update_rate><imu>";
  const std::pair<const char*, const char*> kinds[] = {
      {"angular_velocity", "<stddev>0.001382</stddev><precision>0.0011111</precision>"},
      {"linear_acceleration", "<stddev>0.01163</stddev><precision>0.01</precision>"}};
  for (const auto& [kind, values] : kinds) {
    out += fmt::format("<{}>", kind);
    for (const char* axis : {"x", "y", "z"})
      out += fmt::format("<{0}><noise><type>gaussian_quantized</type>{1}</noise></{0}>", axis, values);
    out += fmt::format("</{}>", kind);
  }
  return out + "</imu></preset>";
}

XmlNode parsed(const Preset& preset) {
  const std::string text = *preset.xml ? preset.xml : bno055();
  XmlNode out = parse_xml(text, std::string("preset ") + preset.name);
  return out;
}

}  // namespace

const XmlNode* find_preset(const XmlNode& sensor, const std::string& element, Diagnostics& diagnostics) {
  const XmlNode* const asked = sensor.first("doppel:preset");
  if (asked == nullptr) return nullptr;
  const std::string name = asked->content();
  const auto* const preset = std::ranges::find(kPresets, name, &Preset::name);
  if (preset == std::end(kPresets)) {
    std::vector<std::string> names;
    for (const Preset& one : kPresets) names.emplace_back(one.name);
    diagnostics.warning(
        "sensor.preset", asked->where,
        fmt::format("there is no preset '{}'; SDF's defaults are used{}", name, did_you_mean(name, names)));
    return nullptr;
  }
  if (element != preset->element) {
    diagnostics.warning(
        "sensor.preset", asked->where,
        fmt::format("the preset '{}' is for <{}>, and not for a sensor of the type '{}'; it has no effect",
                    name, preset->element, sensor.find("type") == nullptr ? "" : sensor.find("type")->value));
    return nullptr;
  }
  static const std::map<std::string, XmlNode> kParsed = [] {
    std::map<std::string, XmlNode> out;
    for (const Preset& one : kPresets) out.emplace(one.name, parsed(one));
    return out;
  }();
  return &kParsed.at(name);
}

}  // namespace doppel
