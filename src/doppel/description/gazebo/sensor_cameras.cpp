// <camera> and <lidar> (<ray>) of sensors of light.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>

#include "doppel/description/gazebo/camera_intrinsics.h"
#include "doppel/description/gazebo/detail/sensor_kinds.h"

namespace doppel {
namespace {

constexpr double kMostPixels = 1 << 26;  // of a picture, and of their samples: 800 MB of directions
constexpr double kMaxPinholeFov = 3.0;   // rad
constexpr double kMostRays = 1e7;        // of a scan

CameraKind kind_of(const std::string& type) {
  if (type == "depth" || type == "depth_camera") return CameraKind::depth;
  if (type.starts_with("rgbd")) return CameraKind::rgbd;
  if (type.starts_with("segmentation")) return CameraKind::segmentation;
  if (type.starts_with("boundingbox")) return CameraKind::boundingbox;
  return CameraKind::colour;
}

LensDescription read_lens(const SensorValues& values) {
  LensDescription lens;
  const std::string type = values.text("lens/type", "gnomonical");
  if (type == "stereographic") lens.kind = LensKind::stereographic;
  if (type == "equidistant") lens.kind = LensKind::equidistant;
  if (type == "equisolid_angle") lens.kind = LensKind::equisolid;
  if (type == "orthographic") lens.kind = LensKind::orthographic;
  if (type == "custom") lens.kind = LensKind::custom;
  lens.scale_to_hfov = values.flag("lens/scale_to_hfov", true);
  lens.c1 = values.number("lens/custom_function/c1", 1);
  lens.c2 = values.number("lens/custom_function/c2", 1);
  lens.c3 = values.number("lens/custom_function/c3", 0);
  lens.f = values.number("lens/custom_function/f", 1);
  lens.function = values.text("lens/custom_function/fun", "tan");
  lens.cutoff_angle = values.number("lens/cutoff_angle", lens.cutoff_angle);
  const char* names[] = {"k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < 5; ++i)
    lens.distortion[i] = values.number(std::string("distortion/") + names[i], 0);
  if (values.has("lens/intrinsics")) {
    lens.intrinsics = LensDescription::Intrinsics{
        values.number("lens/intrinsics/fx", 277), values.number("lens/intrinsics/fy", 277),
        values.number("lens/intrinsics/cx", 160), values.number("lens/intrinsics/cy", 120),
        values.number("lens/intrinsics/s", 0)};
  }
  return lens;
}

std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

// Source: gz-sensors 8, BoundingBoxCameraSensor and SegmentationCameraSensor.
void read_detections(const SensorValues& values, CameraDescription& camera) {
  if (camera.kind != CameraKind::boundingbox && camera.kind != CameraKind::segmentation) return;
  const std::string boxes = lower_case(values.text("box_type")),
                    type = lower_case(values.text("segmentation_type"));
  if (boxes == "full_2d" || boxes == "full_box_2d")
    camera.boxes = BoxKind::full_2d;
  else if (boxes == "3d")
    camera.boxes = BoxKind::oriented_3d;
  else if (boxes == "2d" || boxes == "visible_2d" || boxes == "visible_box_2d")
    camera.boxes = BoxKind::visible_2d;
  else if (!boxes.empty())
    values.refuse("box_type", fmt::format("'{}' is not 2d, visible_2d, full_2d or 3d; boxes are visible_2d",
                                          values.text("box_type")));
  if (type == "semantic" || type == "instance" || type == "panoptic")
    camera.panoptic = type != "semantic";
  else if (!type.empty())
    values.refuse("segmentation_type",
                  fmt::format("'{}' is not semantic, instance or panoptic; pictures are semantic",
                              values.text("segmentation_type")));
}

void limit_size(const SensorValues& values, CameraDescription& camera) {
  const double pixels = static_cast<double>(camera.width) * camera.height;
  if (pixels > kMostPixels) {
    const CameraDescription otherwise;
    values.refuse("image",
                  fmt::format("{} x {} pixels are more than {:.0f} in all; {} x {} are used", camera.width,
                              camera.height, kMostPixels, otherwise.width, otherwise.height));
    camera.width = otherwise.width;
    camera.height = otherwise.height;
  } else if (pixels * camera.samples > kMostPixels) {
    camera.samples = static_cast<int>(kMostPixels / pixels);
    values.refuse("image/anti_aliasing",
                  fmt::format("so many samples of {} x {} pixels need too much memory; "
                              "{} are used",
                              camera.width, camera.height, camera.samples));
  }
}

CameraDescription camera_in(const SensorValues& values, const std::string& type) {
  CameraDescription camera;
  camera.kind = kind_of(type);
  camera.X_SC = values.pose("pose");
  camera.width = values.count("image/width", 320);
  camera.height = values.count("image/height", 240);
  camera.format = values.text("image/format", "R8G8B8");
  camera.samples = std::clamp(values.count("image/anti_aliasing", 1), 1, 64);
  limit_size(values, camera);
  camera.hfov = std::clamp(values.number("horizontal_fov", 1.047), 0.01, 2 * M_PI);
  camera.near = std::clamp(values.number("clip/near", 0.1), 1e-4, 1e6);
  camera.far = std::max(2 * camera.near, values.distance_or_all("clip/far", 100));
  if (values.has("depth_camera/clip/near"))
    camera.depth_near = values.number("depth_camera/clip/near", camera.near);
  if (values.has("depth_camera/clip/far"))
    camera.depth_far = values.distance_or_all("depth_camera/clip/far", camera.far);
  camera.lens = read_lens(values);
  camera.noise = values.noise("noise");
  // A lens of more than a half space is no pinhole.
  if (camera.lens.kind == LensKind::pinhole && camera.hfov > kMaxPinholeFov)
    camera.lens.kind = LensKind::equidistant;
  return camera;
}

// doppel's own elements, beside the camera or in it.
void read_extensions(const SensorValues& values, CameraDescription& camera) {
  Eigen::Vector3d& noise = camera.depth_noise;
  noise = {values.number("doppel:depth_noise/a", noise[0]), values.number("doppel:depth_noise/b", noise[1]),
           values.number("doppel:depth_noise/c", noise[2])};
  camera.dropout = values.within("doppel:dropout", camera.dropout, 0, 1);
  camera.edge_mixing = values.within("doppel:edge_mixing", camera.edge_mixing, 0, 1);
  camera.rolling_shutter = values.within("doppel:rolling_shutter", camera.rolling_shutter, 0, 1);
  camera.exposure = values.not_negative("doppel:exposure", camera.exposure);
}

// The distance of the right cameras of a stereo pair from the left one, the first, if their axes are parallel.
void set_stereo_baselines(std::vector<CameraDescription>& cameras) {
  constexpr double kParallel = 1e-6;
  const Pose& X_SL = cameras.front().X_SC;
  for (CameraDescription& camera : cameras) {
    const Pose X_LC = X_SL.inverse() * camera.X_SC;
    if ((X_LC.linear() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kParallel)
      camera.baseline = -X_LC.translation().y();
  }
}

ScanRange read_scan(const SensorValues& values, const std::string& path, const ScanRange& otherwise) {
  ScanRange out;
  out.samples = values.count(path + "/samples", otherwise.samples);
  out.resolution = values.within(path + "/resolution", 1, 1e-3, 1e3);
  out.min = values.number(path + "/min_angle", otherwise.min);
  out.max = values.number(path + "/max_angle", otherwise.max);
  return out;
}

}  // namespace

void read_camera(const SensorValues& values, SensorDescription& out) {
  std::vector<CameraDescription> cameras;
  out.info_topic = values.text("camera/camera_info_topic");
  if (values.has("camera/optical_frame_id")) {
    out.frame = values.text("camera/optical_frame_id");
    out.frame_is_optical = true;
  }
  const auto add = [&](const XmlNode& element) {
    const SensorValues inner = values.below(element);
    CameraDescription& camera = cameras.emplace_back(camera_in(inner, out.type));
    for (const SensorValues& of : {values, inner}) {
      read_extensions(of, camera);
      read_detections(of, camera);
    }
    const XmlAttribute* name = element.find("name");
    camera.name =
        name == nullptr || name->value.empty() ? "camera" + std::to_string(cameras.size()) : name->value;
  };
  for (const XmlNode& child : values.element().children)
    if (child.is("camera")) add(child);
  if (cameras.empty())
    add(XmlNode{XmlNode::Kind::element, false, "camera", "", {}, {}, values.element().where});
  set_stereo_baselines(cameras);
  out.what = std::move(cameras);
}

void check_lenses(const SensorValues& values, SensorDescription& sensor) {
  auto* const cameras = std::get_if<std::vector<CameraDescription>>(&sensor.what);
  if (cameras == nullptr) return;
  for (CameraDescription& camera : *cameras) {
    const CameraIntrinsics k = intrinsics_of(camera);
    const bool finite = std::isfinite(k.cx + k.cy + k.skew + std::accumulate(k.d.begin(), k.d.end(), 0.0));
    if (finite && k.fx > 0 && k.fy > 0 && std::isfinite(k.fx + k.fy)) continue;
    values.refuse("camera/lens",
                  fmt::format("fx = {}, fy = {} and the distortion give no picture; the lens of "
                              "<horizontal_fov> alone is used",
                              k.fx, k.fy));
    camera.lens = {};
    if (camera.hfov > kMaxPinholeFov) camera.lens.kind = LensKind::equidistant;
  }
}

void read_lidar(const SensorValues& values, SensorDescription& out) {
  LidarDescription lidar;
  const std::string root = values.element().first("lidar") != nullptr ? "lidar" : "ray";
  lidar.horizontal = read_scan(values, root + "/scan/horizontal", lidar.horizontal);
  lidar.vertical = read_scan(values, root + "/scan/vertical", lidar.vertical);
  const double rays = lidar.horizontal.samples * lidar.horizontal.resolution * lidar.vertical.samples *
                      lidar.vertical.resolution;
  if (rays > kMostRays) {
    values.refuse(root + "/scan", fmt::format("{:.0f} rays are more than {:.0f}; one ring of {} is used",
                                              rays, kMostRays, LidarDescription().horizontal.samples));
    lidar.horizontal = LidarDescription().horizontal;
    lidar.vertical = LidarDescription().vertical;
  }
  lidar.near = std::max(0.0, values.number(root + "/range/min", lidar.near));
  lidar.far = values.distance_or_all(root + "/range/max", lidar.far);
  lidar.resolution = std::max(0.0, values.number(root + "/range/resolution", 0));
  lidar.noise = values.noise(root + "/noise");
  lidar.dropout = values.within("doppel:dropout", 0, 0, 1);
  lidar.moving = values.flag("doppel:moving_scan", false);
  out.what = lidar;
}

void read_sonar(const SensorValues& values, SensorDescription& out) {
  RangeDescription range;
  range.near = values.number("sonar/min", range.near);
  range.far = values.distance_or_all("sonar/max", range.far);
  // SDF's cone has the radius at its far end.
  range.field_of_view = 2 * std::atan2(values.number("sonar/radius", 0.5), std::max(1e-6, range.far));
  out.what = range;
}

}  // namespace doppel
