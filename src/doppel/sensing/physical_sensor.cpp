#include "doppel/sensing/detail/physical_sensor.h"

namespace doppel {

geometry_msgs::msg::Vector3 noisy_vector(VectorNoise& noise, const Eigen::Vector3d& value,
                                         std::uint64_t sample) {
  Eigen::Vector3d out;
  for (int i = 0; i < 3; ++i) {
    ChannelNoise& channel = noise[static_cast<std::size_t>(i)];
    channel.advance(sample);
    out[i] = channel.apply(value[i], sample);
  }
  return {out.x(), out.y(), out.z()};
}

std::unique_ptr<PhysicalSensor> make_physical_sensor(Node& node, const RigSensor& sensor,
                                                     const RigOptions& options, double period,
                                                     const Log& log) {
  const auto& what = sensor.description.what;
  if (std::holds_alternative<ImuDescription>(what)) return make_imu_output(node, sensor, options, period);
  if (std::holds_alternative<ForceTorqueDescription>(what))
    return make_wrench_output(node, sensor, options, period);
  if (std::holds_alternative<ContactDescription>(what))
    return make_contact_output(node, sensor, options, log);
  return nullptr;
}

}  // namespace doppel
