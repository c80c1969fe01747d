// LogicalCameraImage: the instances whose origins are in a frustum. Source: gz-sensors 8, LogicalCameraSensor.cc.
#include <cmath>

#include "doppel/ros/messages/ros_gz_interfaces.h"
#include "doppel/sensors/rigs/detail/delay_line.h"
#include "doppel/sensors/rigs/detail/physical_sensor.h"
#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel {
namespace {

using ros_gz_interfaces::msg::LogicalCameraImage;
using ros_gz_interfaces::msg::LogicalCameraImageModel;

class LogicalCameraOutput : public PhysicalSensor {
 public:
  LogicalCameraOutput(Node& node, const RigSensor& sensor, double period)
      : PhysicalSensor(sensor),
        described_(std::get<EnvironmentDescription>(sensor.description.what)),
        message_(blank(sensor)),
        delayed_(sensor.description.latency, period, message_) {
    publisher_ = advertise<LogicalCameraImage>(node, "logical_camera");
    frame_ = sensor.frame;
    across_ = std::tan(described_.hfov / 2);
  }

  [[nodiscard]] bool wanted() const override { return publisher_.has_listeners(); }

  void restart(const Engine& /*engine*/) override { delayed_.clear(); }
  void resume(const PhysicalSensor& before, std::uint64_t /*next*/) override {
    const auto* former = dynamic_cast<const LogicalCameraOutput*>(&before);
    if (former != nullptr && same_values(sensor_, former->sensor_)) delayed_.resume(former->delayed_);
  }
  void save(SavedSlot& slot) const override { value_in<Saved>(slot) = {hash_, delayed_}; }
  void restore(const SavedPart& saved) override {
    const Saved* const before = value_of<Saved>(&saved);
    if (before == nullptr) return;
    hash_ = before->hash;
    delayed_ = before->delayed;
  }
  void bind(const Engine& engine, int instance) override {
    PhysicalSensor::bind(engine, instance);
    const auto& instances = engine.world().instances();
    message_.model.clear();
    message_.model.reserve(instances.size());
    spare_.resize(instances.size());
    std::size_t longest = 0;
    for (const ModelInstance& of : instances) longest = std::max(longest, of.name.size());
    for (LogicalCameraImageModel& one : spare_) one.name.reserve(longest);
  }

  void publish(const PhysicalState& state, std::uint64_t /*sample*/) override {
    for (LogicalCameraImageModel& one : message_.model) spare_.push_back(std::move(one));
    message_.model.clear();
    const auto& instances = state.engine.world().instances();
    const Pose X_WL = state.engine.instance(instance_).link_pose(sensor_.link);
    const Pose X_WS = X_WL * sensor_.description.X_LS;
    const Pose X_FW = (X_WL * sensor_.X_LF).inverse();
    message_.pose = to_pose_msg(X_WS);
    for (int i = 0; i < static_cast<int>(instances.size()); ++i) {
      if (i == instance_) continue;
      const Pose X_WM = state.engine.instance(i).base_pose() * instances[static_cast<std::size_t>(i)].X_BO;
      if (!sees(X_WS.inverse() * X_WM.translation())) continue;
      LogicalCameraImageModel& seen = message_.model.emplace_back(taken(spare_));
      seen.name = instances[static_cast<std::size_t>(i)].name;
      seen.pose = to_pose_msg(X_FW * X_WM);
      hash_value(i);
      hash_vector({seen.pose.position.x, seen.pose.position.y, seen.pose.position.z});
    }
    message_.header.stamp = to_time_msg(state.stamp);
    if (delayed_.delays())
      std::swap(delayed_.add(state.now), message_);
    else
      publisher_.publish(message_, state.now);
  }
  void release(Time now) override {
    delayed_.release(now, [&](const LogicalCameraImage& message) { publisher_.publish(message, now); });
  }
  [[nodiscard]] Time next_release() const override { return delayed_.next_release(); }

 private:
  static LogicalCameraImage blank(const RigSensor& sensor) {
    LogicalCameraImage out;
    out.header.frame_id = sensor.frame;
    return out;
  }
  // x forward, y to the left; the aspect is width over height.
  [[nodiscard]] bool sees(const Eigen::Vector3d& p_S) const {
    return p_S.x() >= described_.near && p_S.x() <= described_.far &&
           std::abs(p_S.y()) <= across_ * p_S.x() &&
           std::abs(p_S.z()) <= across_ / described_.aspect * p_S.x();
  }

  struct Saved {
    std::uint64_t hash = 0;
    DelayLine<LogicalCameraImage> delayed;
  };

  const EnvironmentDescription described_;
  double across_ = 1;  // tangent of half the horizontal angle
  LogicalCameraImage message_;
  DelayLine<LogicalCameraImage> delayed_;
  std::vector<LogicalCameraImageModel> spare_;
  Publisher<LogicalCameraImage> publisher_;
};

}  // namespace

std::unique_ptr<PhysicalSensor> make_logical_camera_output(Node& node, const RigSensor& sensor,
                                                           double period) {
  return std::make_unique<LogicalCameraOutput>(node, sensor, period);
}

}  // namespace doppel
