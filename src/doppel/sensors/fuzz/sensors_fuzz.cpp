// Fuzz target: a <sensor> or <plugin> as the content of <gazebo>, on a link. What is read has finite sizes.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "doppel/sensors/sensor_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace doppel;
  try {
    RobotDescription robot;
    robot.links.push_back({"base", {}, {}, {}, {}});
    GazeboExtension extension;
    extension.reference = "base";
    const std::string text(reinterpret_cast<const char*>(data), size);
    extension.node = std::make_shared<const XmlNode>(parse_xml("<gazebo>" + text + "</gazebo>", "sensor"));
    robot.gazebo.push_back(std::move(extension));
    Diagnostics diagnostics;
    for (const SensorDescription& sensor : read_sensors(robot, diagnostics)) {
      if (!(sensor.rate >= 0) || sensor.link != "base") std::abort();
      if (const auto* cameras = std::get_if<std::vector<CameraDescription>>(&sensor.what))
        for (const CameraDescription& camera : *cameras)
          if (camera.width < 1 || camera.height < 1 || !(camera.far > camera.near)) std::abort();
    }
  } catch (const InputError&) {
  }
  return 0;
}
