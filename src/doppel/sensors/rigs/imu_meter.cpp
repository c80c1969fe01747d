// Specific force, angular velocity and orientation from the motion of a link over a step.
#include "doppel/sensors/rigs/detail/sensor_meter.h"

namespace doppel {
namespace {

constexpr std::size_t kOrientation = 0, kVelocity = 4, kAcceleration = 7, kCount = 10;
constexpr std::size_t kAccelerationNoise = 0, kVelocityNoise = 3, kOrientationNoise = 6;  // channels

// Axes of the frames to which orientations refer, in the world's (x east, y north, z up; REP 103).
Eigen::Matrix3d north_east_down() {
  Eigen::Matrix3d R;
  R << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return R;
}
Eigen::Matrix3d north_west_up() {
  Eigen::Matrix3d R;
  R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  return R;
}

class ImuMeter : public SensorMeter {
 public:
  ImuMeter(const RigSensor& sensor, const MeterSettings& settings)
      : SensorMeter(sensor, kCount), imu_(std::get<ImuDescription>(sensor.description.what)) {
    for (const NoiseDescription& one : imu_.linear_acceleration) add_noise(one, settings);
    for (const NoiseDescription& one : imu_.angular_velocity) add_noise(one, settings);
    for (int i = 0; i < 3; ++i) add_noise(imu_.orientation, settings);
    write_rotation(kOrientation, Eigen::Matrix3d::Identity());
  }

  void restart(const Engine& engine) override {
    SensorMeter::restart(engine);
    if (instance_ >= 0) R_WStart_ = R_WF(engine);
  }
  void resume(const SensorMeter& before, std::uint64_t next) override {
    SensorMeter::resume(before, next);
    if (const auto* imu = dynamic_cast<const ImuMeter*>(&before)) R_WStart_ = imu->R_WStart_;
  }

  void save(Memory& out) const override {
    SensorMeter::save(out);
    out.R_WStart = R_WStart_;
  }
  void restore(const Memory& saved) override {
    SensorMeter::restore(saved);
    R_WStart_ = saved.R_WStart;
  }

  void measure(const PhysicalState& state, std::uint64_t sample) override {
    const auto instance = static_cast<std::size_t>(instance_);
    const auto link = static_cast<std::size_t>(sensor_.link);
    InstanceMotion& motion = *state.motions[instance];
    motion.solve_end(state.engine.instance(instance_), state.engine.world().settings().gravity);
    const auto &V = motion.data().V_WL[link], &A = motion.data().A_WL[link];
    const Eigen::Vector3d p_LS = sensor_.description.X_LS.translation();
    const Eigen::Vector3d w = V.head<3>();
    // The classical acceleration of the sensor's point from the spatial one of the link (Featherstone 2008, eq. 2.48).
    const Eigen::Vector3d a_L = A.tail<3>() + A.head<3>().cross(p_LS) + w.cross(V.tail<3>() + w.cross(p_LS));
    const Eigen::Matrix3d R_FL = sensor_.X_LF.linear().transpose();
    write(kAcceleration, noisy_vector(kAccelerationNoise, R_FL * a_L, sample));
    write(kVelocity, noisy_vector(kVelocityNoise, R_FL * w, sample));
    if (imu_.orientation_enabled) measure_orientation(state.engine, sample);
  }

 private:
  [[nodiscard]] Eigen::Matrix3d R_WF(const Engine& engine) const {
    return (engine.instance(instance_).link_pose(sensor_.link) * sensor_.X_LF).linear();
  }

  // Axes of the frame to which the orientation refers.
  [[nodiscard]] Eigen::Matrix3d R_WReference() const {
    switch (imu_.reference) {
      case OrientationReference::world_enu:
        break;
      case OrientationReference::start:
        return R_WStart_;
      case OrientationReference::grav_up:
        return rotation_from_rpy({0, 0, rpy_from_rotation(R_WStart_).z()});
      case OrientationReference::ned:
        return north_east_down();
      case OrientationReference::nwu:
        return north_west_up();
      case OrientationReference::custom:
        return rotation_from_rpy(imu_.custom_rpy);
    }
    return Eigen::Matrix3d::Identity();
  }

  void measure_orientation(const Engine& engine, std::uint64_t sample) {
    Eigen::Matrix3d R = R_WReference().transpose() * R_WF(engine);
    if (imu_.orientation.any())
      R = rotation_from_rpy(noisy_vector(kOrientationNoise, rpy_from_rotation(R), sample));
    write_rotation(kOrientation, R);
  }

  const ImuDescription imu_;
  Eigen::Matrix3d R_WStart_ = Eigen::Matrix3d::Identity();
};

}  // namespace

std::unique_ptr<SensorMeter> make_imu_meter(const RigSensor& sensor, const MeterSettings& settings) {
  return std::make_unique<ImuMeter>(sensor, settings);
}

}  // namespace doppel
