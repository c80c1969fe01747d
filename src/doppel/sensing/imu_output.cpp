// Imu from the motion of a link over a step.
#include "doppel/messages/sensor_msgs.h"
#include "doppel/sensing/detail/physical_sensor.h"

namespace doppel {
namespace {

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

class ImuOutput : public PhysicalSensor {
 public:
  ImuOutput(Node& node, const RigSensor& sensor, const RigOptions& options, double period)
      : PhysicalSensor(sensor, options), imu_(std::get<ImuDescription>(sensor.description.what)) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      noise_.acceleration[i] = ChannelNoise(imu_.linear_acceleration[i], random_, i, period);
      noise_.velocity[i] = ChannelNoise(imu_.angular_velocity[i], random_, 3 + i, period);
      noise_.orientation[i] = ChannelNoise(imu_.orientation, random_, 6 + i, period);
      message_.linear_acceleration_covariance[4 * i] = variance(imu_.linear_acceleration[i]);
      message_.angular_velocity_covariance[4 * i] = variance(imu_.angular_velocity[i]);
      message_.orientation_covariance[4 * i] = variance(imu_.orientation);
    }
    // REP 145: there is no orientation.
    if (!imu_.orientation_enabled) message_.orientation_covariance = {-1};
    at_start_ = noise_;
    frame_ = message_.header.frame_id = sensor.frame;
    publisher_ = advertise<sensor_msgs::msg::Imu>(node, "imu");
  }

  [[nodiscard]] bool wanted() const override { return publisher_.has_listeners(); }

  void restart(const Engine& engine) override {
    if (instance_ >= 0) R_WStart_ = R_WF(engine);
    noise_ = at_start_;
  }
  void resume(const PhysicalSensor& before) override {
    if (const auto* imu = dynamic_cast<const ImuOutput*>(&before)) R_WStart_ = imu->R_WStart_;
  }

  void publish(const PhysicalState& state, std::uint64_t sample) override {
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
    message_.header.stamp = to_time_msg(state.stamp);
    message_.linear_acceleration = noisy_vector(noise_.acceleration, R_FL * a_L, sample);
    message_.angular_velocity = noisy_vector(noise_.velocity, R_FL * w, sample);
    if (imu_.orientation_enabled) write_orientation(state.engine, sample);
    hash_vector(message_.linear_acceleration);
    hash_vector(message_.angular_velocity);
    hash_vector({message_.orientation.x, message_.orientation.y, message_.orientation.z});
    publisher_.publish(message_, state.now);
  }

 private:
  struct Noise {
    VectorNoise acceleration, velocity, orientation;
  };
  static double variance(const NoiseDescription& noise) { return noise.stddev * noise.stddev; }

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

  void write_orientation(const Engine& engine, std::uint64_t sample) {
    Eigen::Matrix3d R = R_WReference().transpose() * R_WF(engine);
    if (imu_.orientation.any()) {
      const geometry_msgs::msg::Vector3 rpy = noisy_vector(noise_.orientation, rpy_from_rotation(R), sample);
      R = rotation_from_rpy({rpy.x, rpy.y, rpy.z});
    }
    const Eigen::Quaterniond turn(R);
    message_.orientation = {turn.x(), turn.y(), turn.z(), turn.w()};
  }

  const ImuDescription imu_;
  Noise noise_, at_start_;
  Eigen::Matrix3d R_WStart_ = Eigen::Matrix3d::Identity();
  sensor_msgs::msg::Imu message_;
  Publisher<sensor_msgs::msg::Imu> publisher_;
};

}  // namespace

std::unique_ptr<PhysicalSensor> make_imu_output(Node& node, const RigSensor& sensor,
                                                const RigOptions& options, double period) {
  return std::make_unique<ImuOutput>(node, sensor, options, period);
}

}  // namespace doppel
