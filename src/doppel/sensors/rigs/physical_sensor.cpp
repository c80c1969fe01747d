#include "doppel/sensors/rigs/detail/physical_sensor.h"

namespace doppel {

std::unique_ptr<PhysicalSensor> make_physical_sensor(Node& node, const RigSensor& sensor,
                                                     const MeterSettings& settings, const Log& log) {
  const auto& what = sensor.description.what;
  if (std::holds_alternative<ContactDescription>(what))
    return make_contact_output(node, sensor, settings.period, log);
  const auto* const environment = std::get_if<EnvironmentDescription>(&what);
  if (environment != nullptr && environment->kind == EnvironmentKind::logical_camera)
    return make_logical_camera_output(node, sensor, settings.period);
  return make_meter_output(node, sensor, settings);
}

}  // namespace doppel
