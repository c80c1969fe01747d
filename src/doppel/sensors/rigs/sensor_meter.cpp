#include "doppel/sensors/rigs/detail/sensor_meter.h"

namespace doppel {

std::unique_ptr<SensorMeter> make_meter(const RigSensor& sensor, const MeterSettings& settings) {
  const auto& what = sensor.description.what;
  if (std::holds_alternative<ImuDescription>(what)) return make_imu_meter(sensor, settings);
  if (std::holds_alternative<ForceTorqueDescription>(what)) return make_wrench_meter(sensor, settings);
  if (std::holds_alternative<EnvironmentDescription>(what)) return make_environment_meter(sensor, settings);
  return nullptr;
}

}  // namespace doppel
