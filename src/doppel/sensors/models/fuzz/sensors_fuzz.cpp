// Fuzz target: a <sensor> or <plugin> as the content of <gazebo>, on a link. What is read has finite sizes, lenses and
// directions.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <tuple>

#include "doppel/description/gazebo/sensor_reader.h"
#include "doppel/sensors/models/lens.h"
#include "doppel/sensors/models/scan_pattern.h"

namespace {

constexpr int kFew = 2000;  // pixels or rays, so that an execution takes a millisecond

void require(bool holds) {
  if (!holds) std::abort();
}

void check(const doppel::CameraDescription& camera) {
  require(camera.width >= 1 && camera.height >= 1 && camera.far > camera.near);
  const doppel::CameraIntrinsics k = doppel::intrinsics_of(camera);
  require(std::isfinite(k.fx) && std::isfinite(k.fy) && k.fx > 0 && k.fy > 0);
  require(std::isfinite(k.cx) && std::isfinite(k.cy) && std::isfinite(k.skew));
  for (const double d : k.d) require(std::isfinite(d));
  require(std::int64_t{camera.width} * camera.height * camera.samples <= 1 << 26);
  if (std::int64_t{camera.width} * camera.height > kFew) return;
  for (const doppel::PixelRays& rays : doppel::pixel_rays(k, 2))
    for (const std::vector<float>* values : {&rays.x, &rays.y, &rays.z})
      for (const float value : *values) require(std::isfinite(value));
}

void check(const doppel::LidarDescription& lidar) {
  const auto& [across, upwards] = std::tie(lidar.horizontal, lidar.vertical);
  const double rays = across.samples * across.resolution * upwards.samples * upwards.resolution;
  require(rays <= 1e7);
  if (rays > kFew) return;
  const doppel::ScanPattern pattern = doppel::scan_pattern(lidar);
  for (std::size_t i = 0; i < pattern.size(); ++i) require(std::abs(pattern.direction(i).norm() - 1) < 1e-5F);
}

}  // namespace

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
      require(sensor.rate >= 0 && sensor.link == "base");
      if (const auto* cameras = std::get_if<std::vector<CameraDescription>>(&sensor.what))
        for (const CameraDescription& camera : *cameras) check(camera);
      if (const auto* lidar = std::get_if<LidarDescription>(&sensor.what)) check(*lidar);
      if (const auto* range = std::get_if<RangeDescription>(&sensor.what)) check(range->rays);
    }
  } catch (const InputError&) {
  }
  return 0;
}
