// Pictures, depths, labels and points of cameras as ROS's messages.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "doppel/base/images/image.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/sensors/models/image_noise.h"
#include "doppel/sensors/models/lens.h"
#include "doppel/sensors/models/sensor_frames.h"
#include "doppel/sensors/rigs/detail/light_sensor.h"
#include "doppel/sensors/rigs/detail/object_labels.h"
#include "doppel/sensors/rigs/detail/pixel_formats.h"
#include "doppel/sensors/rigs/detail/rolling_shutter.h"

namespace doppel {
namespace {

namespace msg = sensor_msgs::msg;

constexpr int kJpegQuality = 80;
constexpr int kNone = -1;

// Depths of a picture that also has colours, whose limits are wider.
void clip_depths(const CameraDescription& camera, std::vector<float>& depths) {
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  const auto near = static_cast<float>(camera.depth_near.value_or(camera.near)),
             far = static_cast<float>(camera.depth_far.value_or(camera.far));
  for (float& depth : depths) {
    if (depth < near) depth = -kInfinite;
    if (depth > far) depth = kInfinite;
  }
}

std::string beside(const std::string& topic, const std::string& name) {
  const std::size_t slash = topic.rfind('/');
  return slash == std::string::npos ? name : topic.substr(0, slash + 1) + name;
}

class CameraOutput : public LightSensor {
 public:
  CameraOutput(Node& node, const RigSensor& sensor, const RigOptions& options)
      : LightSensor(sensor, options), seed_(options.seed) {
    const auto& cameras = std::get<std::vector<CameraDescription>>(sensor.description.what);
    for (const CameraDescription& camera : cameras) add_camera(node, camera, cameras.size() > 1);
  }

  void make(const RayCaster& caster, const LightSample& sample, Time stamp,
            std::vector<LightMessage>& out) override {
    for (Camera& camera : cameras_) make_one(caster, camera, sample, stamp, out);
  }

 private:
  struct Camera {
    CameraDescription description;
    CameraIntrinsics intrinsics;
    CounterRandom random;
    std::vector<PixelRays> rays;  // made at the first sample
    std::optional<RollingShutter> shutter;
    Pose X_LO = Pose::Identity();  // the optical frame in the link
    int image = kNone, info = kNone, compressed = kNone, depth = kNone, points = kNone, labels = kNone,
        colours_of_labels = kNone, depth_info = kNone, boxes = kNone;  // outlets
    CameraPicture picture;
    std::vector<float> scratch;
  };

  void add_camera(Node& node, const CameraDescription& description, bool several);
  void add_topics(Node& node, Camera& camera, const std::string& base, const std::string& prefix,
                  bool written);
  void make_one(const RayCaster& caster, Camera& camera, const LightSample& sample, Time stamp,
                std::vector<LightMessage>& out);
  void render(const RayCaster& caster, Camera& camera, const LightSample& sample,
              const CameraView& view) const;
  [[nodiscard]] msg::CameraInfo info_of(const Camera& camera, const std_msgs::msg::Header& header) const;
  void add_image(const Camera& camera, const LightSample& sample, const std_msgs::msg::Header& header,
                 std::vector<LightMessage>& out) const;
  void add_depth(const Camera& camera, const std_msgs::msg::Header& header,
                 std::vector<LightMessage>& out) const;
  void add_points(const Camera& camera, const std_msgs::msg::Header& header,
                  std::vector<LightMessage>& out) const;
  void add_labels(const Camera& camera, const LightSample& sample, const std_msgs::msg::Header& header,
                  std::vector<LightMessage>& out) const;

  void add_boxes(const Camera& camera, const LightSample& sample, const std_msgs::msg::Header& header,
                 std::vector<LightMessage>& out) const;

  static bool asks(const LightSample& sample, int outlet) {
    return outlet != kNone && sample.wanted[static_cast<std::size_t>(outlet)];
  }
  template <class M>
  static void put(int outlet, const M& message, std::vector<LightMessage>& out) {
    out.push_back({static_cast<std::size_t>(outlet), std::make_shared<const Bytes>(to_cdr(message))});
  }

  std::uint64_t seed_;
  std::vector<Camera> cameras_;
};

void CameraOutput::add_camera(Node& node, const CameraDescription& description, bool several) {
  Camera camera;
  camera.description = description;
  camera.intrinsics = intrinsics_of(description);
  // Pictures of a stereo pair with the same noise would match best where the scene is infinitely far away.
  camera.random = several ? CounterRandom(seed_, sensor_key(sensor_) + "/" + description.name) : random_;
  camera.X_LO = sensor_.description.X_LS * description.X_SC * optical_axes();
  const bool written = !sensor_.description.topic.empty();
  std::string base = written ? sensor_.description.topic : sensor_.description.name;
  if (several) base += "/" + description.name;
  add_topics(node, camera, base, several ? description.name + "/" : "", written && !several);
  cameras_.push_back(std::move(camera));
}

// prefix: of outputs, of one of several cameras: "left/image".
void CameraOutput::add_topics(Node& node, Camera& camera, const std::string& base, const std::string& prefix,
                              bool written) {
  const auto image = [&](const std::string& output, const std::string& topic) {
    return static_cast<int>(add_outlet<msg::Image>(node, prefix + output, topic));
  };
  std::string picture = base;
  switch (camera.description.kind) {
    case CameraKind::boundingbox:
      camera.boxes = static_cast<int>(
          camera.description.boxes == BoxKind::oriented_3d
              ? add_outlet<vision_msgs::msg::Detection3DArray>(node, prefix + "boxes", base)
              : add_outlet<vision_msgs::msg::Detection2DArray>(node, prefix + "boxes", base));
      picture = base + "_image";
      camera.image = image("image", picture);
      camera.compressed = static_cast<int>(
          add_outlet<msg::CompressedImage>(node, prefix + "compressed", picture + "/compressed"));
      break;
    case CameraKind::colour:
      picture = written ? base : base + "/image_raw";
      camera.image = image("image", picture);
      camera.compressed = static_cast<int>(
          add_outlet<msg::CompressedImage>(node, prefix + "compressed", topics_.back() + "/compressed"));
      break;
    case CameraKind::depth:
      picture = written ? base : base + "/depth";
      camera.depth = image("depth", picture);
      camera.points =
          static_cast<int>(add_outlet<msg::PointCloud2>(node, prefix + "points", base + "/points"));
      break;
    case CameraKind::rgbd:
      picture = base + "/image";
      camera.image = image("image", picture);
      camera.compressed = static_cast<int>(
          add_outlet<msg::CompressedImage>(node, prefix + "compressed", topics_.back() + "/compressed"));
      camera.depth = image("depth", base + "/depth_image");
      camera.points =
          static_cast<int>(add_outlet<msg::PointCloud2>(node, prefix + "points", base + "/points"));
      break;
    case CameraKind::segmentation:
      picture = base + "/labels_map";
      camera.labels = image("labels", picture);
      camera.colours_of_labels = image("colored", base + "/colored_map");
      break;
  }
  const std::string& given = sensor_.description.info_topic;
  camera.info = static_cast<int>(add_outlet<msg::CameraInfo>(
      node, prefix + "camera_info", given.empty() ? beside(picture, "camera_info") : given));
  const std::string of_depth = prefix + "depth_camera_info";
  for (const auto& [output, topic] : sensor_.description.topics)
    if (output == of_depth)
      camera.depth_info = static_cast<int>(add_outlet<msg::CameraInfo>(node, of_depth, topic));
}

msg::CameraInfo CameraOutput::info_of(const Camera& camera, const std_msgs::msg::Header& header) const {
  const CameraIntrinsics& c = camera.intrinsics;
  msg::CameraInfo info;
  info.header = header;
  info.width = static_cast<std::uint32_t>(c.width);
  info.height = static_cast<std::uint32_t>(c.height);
  info.distortion_model = c.model == Distortion::plumb_bob ? "plumb_bob" : "equidistant";
  info.d.assign(c.d.begin(), c.d.begin() + (c.model == Distortion::plumb_bob ? 5 : 4));
  info.k = {c.fx, c.skew, c.cx, 0, c.fy, c.cy, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const double shift = camera.description.baseline == 0 ? 0.0 : -c.fx * camera.description.baseline;
  info.p = {c.fx, c.skew, c.cx, shift, 0, c.fy, c.cy, 0, 0, 0, 1, 0};
  return info;
}

void CameraOutput::make_one(const RayCaster& caster, Camera& camera, const LightSample& sample, Time stamp,
                            std::vector<LightMessage>& out) {
  std_msgs::msg::Header header;
  header.stamp = to_time_msg(stamp);
  header.frame_id = frame();
  const bool cloud = asks(sample, camera.points);
  CameraView view;
  view.colour = asks(sample, camera.image) || asks(sample, camera.compressed) ||
                (cloud && camera.description.kind == CameraKind::rgbd);
  view.depth = asks(sample, camera.depth) || cloud;
  view.labels =
      asks(sample, camera.labels) || asks(sample, camera.colours_of_labels) || asks(sample, camera.boxes);
  if (view.colour || view.depth || view.labels) {
    if (camera.rays.empty()) camera.rays = pixel_rays(camera.intrinsics, camera.description.samples);
    view.samples = camera.rays;
    view.X_WC = sample.link.X_WF * camera.X_LO;
    view.near = camera.description.near;
    view.far = camera.description.far;
    if (view.depth && !view.colour) {
      view.near = camera.description.depth_near.value_or(view.near);
      view.far = camera.description.depth_far.value_or(view.far);
    }
    view.own_body = sample.body;
    render(caster, camera, sample, view);
    if (view.colour) {
      expose(camera.description.exposure, camera.picture.rgb);
      add_colour_noise(camera.description.noise, camera.random, sample.number, camera.picture.rgb,
                       camera.scratch);
    }
    if (view.depth && view.colour) clip_depths(camera.description, camera.picture.depth);
    if (view.depth)
      add_depth_noise(camera.description, camera.random, sample.number, camera.picture.depth, camera.scratch);
    add_image(camera, sample, header, out);
    if (asks(sample, camera.depth)) add_depth(camera, header, out);
    if (cloud) add_points(camera, header, out);
    if (view.labels) add_labels(camera, sample, header, out);
    if (asks(sample, camera.boxes)) add_boxes(camera, sample, header, out);
  }
  for (const int outlet : {camera.info, camera.depth_info})
    if (asks(sample, outlet)) put(outlet, info_of(camera, header), out);
}

void CameraOutput::render(const RayCaster& caster, Camera& camera, const LightSample& sample,
                          const CameraView& view) const {
  const double duration = camera.description.rolling_shutter;
  if (!sample.link.moves_in(duration)) {
    caster.render(view, camera.picture);
    return;
  }
  if (!camera.shutter) camera.shutter.emplace(camera.rays);
  // The last row is that of the stamp.
  camera.shutter->render(caster, view, sample.link, camera.X_LO, duration, camera.picture);
}

void CameraOutput::add_image(const Camera& camera, const LightSample& sample,
                             const std_msgs::msg::Header& header, std::vector<LightMessage>& out) const {
  const int width = camera.description.width, height = camera.description.height;
  if (asks(sample, camera.image)) {
    msg::Image image;
    image.header = header;
    image.width = static_cast<std::uint32_t>(width);
    image.height = static_cast<std::uint32_t>(height);
    encode_pixels(camera.description.format, width, camera.picture.rgb, image);
    put(camera.image, image, out);
  }
  if (asks(sample, camera.compressed)) {
    msg::CompressedImage compressed;
    compressed.header = header;
    compressed.format = "rgb8; jpeg compressed bgr8";
    const std::string bytes = encode_jpeg(Bitmap{width, height, 3, camera.picture.rgb}, kJpegQuality);
    compressed.data.assign(bytes.begin(), bytes.end());
    put(camera.compressed, compressed, out);
  }
}

void CameraOutput::add_depth(const Camera& camera, const std_msgs::msg::Header& header,
                             std::vector<LightMessage>& out) const {
  msg::Image image;
  image.header = header;
  image.width = static_cast<std::uint32_t>(camera.description.width);
  image.height = static_cast<std::uint32_t>(camera.description.height);
  encode_depths(camera.description.format, camera.picture.depth, image);
  put(camera.depth, image, out);
}

void CameraOutput::add_points(const Camera& camera, const std_msgs::msg::Header& header,
                              std::vector<LightMessage>& out) const {
  const bool coloured = !camera.picture.rgb.empty();
  msg::PointCloud2 cloud;
  cloud.header = header;
  cloud.width = static_cast<std::uint32_t>(camera.description.width);
  cloud.height = static_cast<std::uint32_t>(camera.description.height);
  const char* names[] = {"x", "y", "z", "rgb"};
  for (std::uint32_t i = 0; i < (coloured ? 4U : 3U); ++i)
    cloud.fields.push_back({names[i], 4 * i, msg::PointField::FLOAT32, 1});
  cloud.point_step = 16;
  cloud.row_step = cloud.width * cloud.point_step;
  cloud.data.resize(std::size_t{cloud.row_step} * cloud.height);
  cloud.is_dense = true;
  const Pose X_FO = sensor_.X_LF.inverse() * camera.X_LO;
  const Eigen::Matrix3f R = X_FO.linear().cast<float>();
  const Eigen::Vector3f p = X_FO.translation().cast<float>();
  const PixelRays& rays = camera.rays.front();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < camera.picture.depth.size(); ++i) {
    const float depth = camera.picture.depth[i];
    Eigen::Vector3f point = Eigen::Vector3f::Constant(kNan);
    if (std::isfinite(depth))
      point = R * (depth * Eigen::Vector3f(rays.x[i], rays.y[i], rays.z[i])) + p;
    else
      cloud.is_dense = false;
    std::memcpy(&cloud.data[16 * i], point.data(), 12);
    if (!coloured) continue;
    const std::uint8_t* rgb = &camera.picture.rgb[3 * i];
    const std::uint32_t packed = std::uint32_t{rgb[0]} << 16 | std::uint32_t{rgb[1]} << 8 | rgb[2];
    std::memcpy(&cloud.data[16 * i + 12], &packed, 4);
  }
  put(camera.points, cloud, out);
}

void CameraOutput::add_labels(const Camera& camera, const LightSample& sample,
                              const std_msgs::msg::Header& header, std::vector<LightMessage>& out) const {
  std::vector<std::uint32_t> classes(camera.picture.labels.size());
  for (std::size_t i = 0; i < classes.size(); ++i)
    classes[i] = camera.description.panoptic ? sample.objects->panoptic_of(camera.picture.labels[i])
                                             : sample.objects->class_of(camera.picture.labels[i]);
  msg::Image image;
  image.header = header;
  image.width = static_cast<std::uint32_t>(camera.description.width);
  image.height = static_cast<std::uint32_t>(camera.description.height);
  if (asks(sample, camera.labels)) {
    (camera.description.panoptic ? encode_panoptic : encode_labels)(classes, image);
    put(camera.labels, image, out);
  }
  if (asks(sample, camera.colours_of_labels)) {
    colour_labels(classes, image);
    put(camera.colours_of_labels, image, out);
  }
}

void CameraOutput::add_boxes(const Camera& camera, const LightSample& sample,
                             const std_msgs::msg::Header& header, std::vector<LightMessage>& out) const {
  const std::vector<std::uint32_t>& labels = camera.picture.labels;
  const auto put_all = [&](auto message, auto detections) {
    message.header = header;
    message.detections = std::move(detections);
    for (auto& box : message.detections) box.header = header;
    put(camera.boxes, message, out);
  };
  if (camera.description.boxes == BoxKind::oriented_3d)
    put_all(vision_msgs::msg::Detection3DArray(),
            oriented_boxes_of(*sample.objects, labels, sample.bodies,
                              (sample.link.X_WF * sensor_.X_LF).inverse()));
  else
    put_all(vision_msgs::msg::Detection2DArray(),
            boxes_of(*sample.objects, labels, camera.intrinsics, camera.description.boxes == BoxKind::full_2d,
                     sample.bodies, sample.link.X_WF * camera.X_LO));
}

}  // namespace

std::unique_ptr<LightSensor> make_camera_output(Node& node, const RigSensor& sensor,
                                                const RigOptions& options) {
  return std::make_unique<CameraOutput>(node, sensor, options);
}

}  // namespace doppel
