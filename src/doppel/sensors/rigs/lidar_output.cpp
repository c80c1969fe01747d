// Scans of lidars and ranges of single beams as ROS's messages.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/sensors/models/noise.h"
#include "doppel/sensors/models/scan_pattern.h"
#include "doppel/sensors/rigs/detail/light_sensor.h"

namespace doppel {
namespace {

namespace msg = sensor_msgs::msg;

constexpr float kInfinite = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kDropoutChannel = 9;

// A sphere around all origins of the rays.
struct Origins {
  Eigen::Vector3d centre;
  double radius;
};
Origins origins_of(const RayBatch& rays) {
  const auto [low_x, high_x] = std::minmax_element(rays.origin_x.begin(), rays.origin_x.end());
  const auto [low_y, high_y] = std::minmax_element(rays.origin_y.begin(), rays.origin_y.end());
  const auto [low_z, high_z] = std::minmax_element(rays.origin_z.begin(), rays.origin_z.end());
  const Eigen::Vector3d low(*low_x, *low_y, *low_z), high(*high_x, *high_y, *high_z);
  return {(low + high) / 2, (high - low).norm() / 2};
}

// A surface nearer than the sensor's range, except its own housing, is -infinity (REP 117).
void mark_near(const RayCaster& caster, RayBatch& rays, double near, int own_body, HitBatch& scratch,
               std::vector<float>& ranges) {
  if (near <= 0) return;
  const Origins origins = origins_of(rays);
  if (!caster.may_be_near(origins.centre, origins.radius + near, own_body)) return;
  rays.near = 0;
  rays.far = static_cast<float>(near);
  caster.cast(rays, scratch);
  const std::vector<SceneItem>& items = caster.scene().items;
  for (std::size_t i = 0; i < ranges.size(); ++i)
    if (scratch.item[i] >= 0 && items[static_cast<std::size_t>(scratch.item[i])].body != own_body)
      ranges[i] = -kInfinite;
}

// A sensor of distances, whose samples have one channel of noise.
class DistanceSensor : public LightSensor {
 public:
  DistanceSensor(const RigSensor& sensor, const RigOptions& options, const NoiseDescription& noise)
      : LightSensor(sensor, options), noise_(noise, random_, 0, period_) {}

  void restart() override {
    LightSensor::restart();
    noise_.restart();
  }
  void resume(const LightSensor& before, std::uint64_t next) override {
    if (const auto* other = dynamic_cast<const DistanceSensor*>(&before)) noise_.resume(other->noise_, next);
  }
  [[nodiscard]] Memory memory() const override {
    Memory out = LightSensor::memory();
    out.walk = noise_.begin();
    return out;
  }
  void restore(const Memory& saved) override {
    LightSensor::restore(saved);
    noise_.set_begin(saved.walk);
  }

 protected:
  ChannelNoise noise_;
};

class LidarOutput : public DistanceSensor {
 public:
  LidarOutput(Node& node, const RigSensor& sensor, const RigOptions& options)
      : DistanceSensor(sensor, options, std::get<LidarDescription>(sensor.description.what).noise),
        lidar_(std::get<LidarDescription>(sensor.description.what)),
        pattern_(scan_pattern(lidar_)) {
    const std::string base =
        sensor.description.topic.empty() ? sensor.description.name : sensor.description.topic;
    if (!sensor.description.points_only)
      scan_ = static_cast<int>(add_outlet<msg::LaserScan>(node, "scan", base));
    points_ = static_cast<int>(add_outlet<msg::PointCloud2>(
        node, "points", sensor.description.points_only ? base : base + "/points"));
  }

  void make(const RayCaster& caster, const LightSample& sample, Time stamp,
            std::vector<LightMessage>& out) override;

 private:
  void measure(const RayCaster& caster, const LightSample& sample);
  [[nodiscard]] msg::LaserScan scan(const std_msgs::msg::Header& header) const;
  [[nodiscard]] msg::PointCloud2 cloud(const std_msgs::msg::Header& header) const;

  const LidarDescription lidar_;
  const ScanPattern pattern_;
  int scan_ = -1, points_ = -1;
  RayBatch rays_;
  HitBatch hits_, near_;
  std::vector<float> ranges_, scratch_;
};

void LidarOutput::measure(const RayCaster& caster, const LightSample& sample) {
  // The scan begins at its stamp in ROS; the sample is taken at its end, so the rays are those before it.
  place_rays(pattern_, sample.link, sensor_.description.X_LS, lidar_.moving ? period_ : 0, rays_);
  rays_.near = static_cast<float>(lidar_.near);
  rays_.far = static_cast<float>(lidar_.far);
  caster.cast(rays_, hits_);
  ranges_ = hits_.distance;
  mark_near(caster, rays_, lidar_.near, sample.body, near_, ranges_);
  noise_.apply(ranges_, sample.number, scratch_);
  for (float& range : ranges_) {
    if (!std::isfinite(range)) continue;
    if (lidar_.resolution > 0)
      range = static_cast<float>(std::round(range / lidar_.resolution) * lidar_.resolution);
    if (range < lidar_.near) range = -kInfinite;
    if (range > lidar_.far) range = kInfinite;
  }
  if (lidar_.dropout <= 0) return;
  for (std::size_t i = 0; i < ranges_.size(); ++i)
    if (random_.uniform(sample.number, kDropoutChannel, static_cast<std::uint32_t>(i)) < lidar_.dropout)
      ranges_[i] = std::numeric_limits<float>::quiet_NaN();
}

msg::LaserScan LidarOutput::scan(const std_msgs::msg::Header& header) const {
  msg::LaserScan out;
  out.header = header;
  out.angle_min = static_cast<float>(pattern_.angle_min);
  out.angle_max = static_cast<float>(pattern_.angle_max);
  out.angle_increment = static_cast<float>(pattern_.angle_increment);
  out.scan_time = static_cast<float>(period_);
  out.time_increment = lidar_.moving ? static_cast<float>(period_ / pattern_.columns) : 0;
  out.range_min = static_cast<float>(lidar_.near);
  out.range_max = static_cast<float>(lidar_.far);
  const auto columns = static_cast<std::size_t>(pattern_.columns);
  const std::size_t first = static_cast<std::size_t>(pattern_.middle_ring()) * columns;
  out.ranges.assign(ranges_.begin() + static_cast<std::ptrdiff_t>(first),
                    ranges_.begin() + static_cast<std::ptrdiff_t>(first + columns));
  for (std::size_t i = first; i < first + columns; ++i)
    out.intensities.push_back(std::isfinite(ranges_[i]) ? 255 * hits_.brightness[i] * hits_.cosine[i] : 0);
  return out;
}

msg::PointCloud2 LidarOutput::cloud(const std_msgs::msg::Header& header) const {
  msg::PointCloud2 out;
  out.header = header;
  out.width = static_cast<std::uint32_t>(pattern_.columns);
  out.height = static_cast<std::uint32_t>(pattern_.rings);
  out.fields = {{"x", 0, msg::PointField::FLOAT32, 1},
                {"y", 4, msg::PointField::FLOAT32, 1},
                {"z", 8, msg::PointField::FLOAT32, 1},
                {"intensity", 12, msg::PointField::FLOAT32, 1},
                {"ring", 16, msg::PointField::UINT16, 1}};
  if (lidar_.moving) out.fields.push_back({"t", 20, msg::PointField::FLOAT32, 1});
  out.point_step = 24;
  out.row_step = out.width * out.point_step;
  out.data.resize(std::size_t{out.row_step} * out.height);
  out.is_dense = true;
  const Pose X_FS = sensor_.X_LF.inverse() * sensor_.description.X_LS;
  const Eigen::Matrix3f R = X_FS.linear().cast<float>();
  const Eigen::Vector3f p = X_FS.translation().cast<float>();
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    Eigen::Vector3f point = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
    if (std::isfinite(ranges_[i]))
      point = R * (ranges_[i] * pattern_.direction(i)) + p;
    else
      out.is_dense = false;
    const float intensity = std::isfinite(ranges_[i]) ? 255 * hits_.brightness[i] * hits_.cosine[i] : 0;
    const auto ring = static_cast<std::uint16_t>(i / out.width);
    std::uint8_t* at = &out.data[24 * i];
    std::memcpy(at, point.data(), 12);
    std::memcpy(at + 12, &intensity, 4);
    std::memcpy(at + 16, &ring, 2);
    const auto t = static_cast<float>(period_ * static_cast<double>(i % out.width) / pattern_.columns);
    if (lidar_.moving) std::memcpy(at + 20, &t, 4);
  }
  return out;
}

void LidarOutput::make(const RayCaster& caster, const LightSample& sample, Time stamp,
                       std::vector<LightMessage>& out) {
  measure(caster, sample);
  std_msgs::msg::Header header;
  header.stamp = to_time_msg(stamp);
  header.frame_id = frame();
  const auto asks = [&](int outlet) {
    return outlet >= 0 && sample.wanted[static_cast<std::size_t>(outlet)];
  };
  if (asks(scan_))
    out.push_back({static_cast<std::size_t>(scan_), std::make_shared<const Bytes>(to_cdr(scan(header)))});
  if (asks(points_))
    out.push_back({static_cast<std::size_t>(points_), std::make_shared<const Bytes>(to_cdr(cloud(header)))});
}

// A plugin that publishes the nearest range of a ray sensor, whose rays it has; a sonar has a cone.
bool has_rays(const SensorDescription& description) {
  return description.type.ends_with("ray") || description.type.ends_with("lidar");
}

class RangeOutput : public DistanceSensor {
 public:
  RangeOutput(Node& node, const RigSensor& sensor, const RigOptions& options)
      : DistanceSensor(sensor, options, std::get<RangeDescription>(sensor.description.what).rays.noise),
        described_(std::get<RangeDescription>(sensor.description.what)),
        pattern_(has_rays(sensor.description) ? scan_pattern(described_.rays) : cone_pattern(described_)) {
    add_outlet<msg::Range>(
        node, "range", sensor.description.topic.empty() ? sensor.description.name : sensor.description.topic);
  }

  void make(const RayCaster& caster, const LightSample& sample, Time stamp,
            std::vector<LightMessage>& out) override {
    place_rays(pattern_, sample.link, sensor_.description.X_LS, 0, rays_);
    rays_.near = static_cast<float>(described_.near);
    rays_.far = static_cast<float>(described_.far);
    caster.cast(rays_, hits_);
    std::vector<float> distances = hits_.distance;
    mark_near(caster, rays_, described_.near, sample.body, near_, distances);
    msg::Range message;
    message.header.stamp = to_time_msg(stamp);
    message.header.frame_id = frame();
    message.radiation_type = described_.ultrasound ? msg::Range::ULTRASOUND : msg::Range::INFRARED;
    message.field_of_view = static_cast<float>(described_.field_of_view);
    message.min_range = static_cast<float>(described_.near);
    message.max_range = static_cast<float>(described_.far);
    message.range = *std::min_element(distances.begin(), distances.end());
    if (std::isfinite(message.range))
      message.range = static_cast<float>(noise_.apply(message.range, sample.number));
    message.variance = static_cast<float>(noise_.stddev() * noise_.stddev());
    if (range_) range_->range = message.range;
    if (sample.wanted[0]) out.push_back({0, std::make_shared<const Bytes>(to_cdr(message))});
  }

 private:
  const RangeDescription described_;
  const ScanPattern pattern_;
  RayBatch rays_;
  HitBatch hits_, near_;
};

}  // namespace

std::unique_ptr<LightSensor> make_lidar_output(Node& node, const RigSensor& sensor,
                                               const RigOptions& options) {
  return std::make_unique<LidarOutput>(node, sensor, options);
}

std::unique_ptr<LightSensor> make_range_output(Node& node, const RigSensor& sensor,
                                               const RigOptions& options) {
  return std::make_unique<RangeOutput>(node, sensor, options);
}

}  // namespace doppel
