// Position by satellites, magnetic field, height, pressure and pose of a point of a link. Source: gz-sensors 8,
// NavSatSensor.cc, MagnetometerSensor.cc, AltimeterSensor.cc, AirPressureSensor.cc.
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/sensors/rigs/detail/sensor_meter.h"

namespace doppel {
namespace {

using sensor_msgs::msg::NavSatStatus;

class EnvironmentMeter : public SensorMeter {
 public:
  EnvironmentMeter(const RigSensor& sensor, const MeterSettings& settings, std::size_t count)
      : SensorMeter(sensor, count),
        described_(std::get<EnvironmentDescription>(sensor.description.what)),
        settings_(settings) {}

 protected:
  // The element of SDF that applies to each of the values with noise.
  void set_noise(std::initializer_list<std::size_t> elements) {
    for (const std::size_t element : elements) add_noise(described_.noise[element], settings_);
  }
  [[nodiscard]] Eigen::Vector3d position(const Engine& engine) const {
    return engine.instance(instance_).link_pose(sensor_.link) * sensor_.description.X_LS.translation();
  }
  [[nodiscard]] Pose X_WF(const Engine& engine) const {
    return engine.instance(instance_).link_pose(sensor_.link) * sensor_.X_LF;
  }

  const EnvironmentDescription described_;
  const MeterSettings settings_;
};

class SatelliteMeter : public EnvironmentMeter {
 public:
  SatelliteMeter(const RigSensor& sensor, const MeterSettings& settings)
      : EnvironmentMeter(sensor, settings, 8) {
    set_noise({0, 0, 1});
    const double across = variance_of(described_.noise[0]), up = variance_of(described_.noise[1]);
    values_ = {NavSatStatus::STATUS_FIX, NavSatStatus::SERVICE_GPS, 0, 0, 0, across, across, up};
  }

  // SDF's noise is in m, so that it moves the point before its coordinates are computed.
  void measure(const PhysicalState& state, std::uint64_t sample) override {
    const Eigen::Vector3d p_W = noisy_vector(0, position(state.engine), sample);
    const GeographicPoint at = geographic_point(settings_.earth, p_W);
    values_[2] = at.latitude;
    values_[3] = at.longitude;
    values_[4] = at.altitude;
  }
};

class FieldMeter : public EnvironmentMeter {
 public:
  FieldMeter(const RigSensor& sensor, const MeterSettings& settings) : EnvironmentMeter(sensor, settings, 3) {
    set_noise({0, 1, 2});
  }

  void measure(const PhysicalState& state, std::uint64_t sample) override {
    const Eigen::Matrix3d R_FW = X_WF(state.engine).linear().transpose();
    write(0, noisy_vector(0, R_FW * settings_.earth.magnetic_field, sample));
  }
};

class HeightMeter : public EnvironmentMeter {
 public:
  HeightMeter(const RigSensor& sensor, const MeterSettings& settings)
      : EnvironmentMeter(sensor, settings, 3) {
    set_noise({0, 1});
  }

  void restart(const Engine& engine) override {
    SensorMeter::restart(engine);
    if (instance_ >= 0) reference_ = position(engine).z();
  }
  void resume(const SensorMeter& before, std::uint64_t next) override {
    SensorMeter::resume(before, next);
    if (const auto* height = dynamic_cast<const HeightMeter*>(&before)) reference_ = height->reference_;
  }

  void save(Memory& out) const override {
    SensorMeter::save(out);
    out.reference = reference_;
  }
  void restore(const Memory& saved) override {
    SensorMeter::restore(saved);
    reference_ = saved.reference;
  }

  void measure(const PhysicalState& state, std::uint64_t sample) override {
    const Instance instance = state.engine.instance(instance_);
    const FrameVelocity velocity = instance.link_velocity(sensor_.link);
    const Eigen::Vector3d p_LS_W =
        instance.link_pose(sensor_.link).linear() * sensor_.description.X_LS.translation();
    const Eigen::Vector3d v_W = velocity.linear_W + velocity.angular_W.cross(p_LS_W);
    values_[0] = noisy(0, position(state.engine).z() - reference_, sample);
    values_[1] = noisy(1, v_W.z(), sample);
    values_[2] = reference_;
  }

 private:
  double reference_ = 0;  // m: the height at the start
};

class PressureMeter : public EnvironmentMeter {
 public:
  PressureMeter(const RigSensor& sensor, const MeterSettings& settings)
      : EnvironmentMeter(sensor, settings, 2) {
    set_noise({0});
    values_[1] = variance_of(described_.noise[0]);
  }

  void measure(const PhysicalState& state, std::uint64_t sample) override {
    values_[0] = noisy(0, standard_pressure(described_.reference + position(state.engine).z()), sample);
  }
};

class PoseMeter : public EnvironmentMeter {
 public:
  PoseMeter(const RigSensor& sensor, const MeterSettings& settings) : EnvironmentMeter(sensor, settings, 7) {}

  void measure(const PhysicalState& state, std::uint64_t /*sample*/) override {
    const Pose X = X_WF(state.engine);
    write(0, X.translation());
    write_rotation(3, X.linear());
  }
};

}  // namespace

std::unique_ptr<SensorMeter> make_environment_meter(const RigSensor& sensor, const MeterSettings& settings) {
  switch (std::get<EnvironmentDescription>(sensor.description.what).kind) {
    case EnvironmentKind::navsat:
      return std::make_unique<SatelliteMeter>(sensor, settings);
    case EnvironmentKind::magnetometer:
      return std::make_unique<FieldMeter>(sensor, settings);
    case EnvironmentKind::altimeter:
      return std::make_unique<HeightMeter>(sensor, settings);
    case EnvironmentKind::air_pressure:
      return std::make_unique<PressureMeter>(sensor, settings);
    case EnvironmentKind::pose:
      return std::make_unique<PoseMeter>(sensor, settings);
    case EnvironmentKind::logical_camera:
      break;
  }
  return nullptr;
}

}  // namespace doppel
