#include "doppel/twin/robot_sensors.h"

#include "doppel/sensors/sensor_reader.h"
#include "doppel/twin/compiled_robot.h"

namespace doppel {

RobotSensors find_sensors(const SdfModel& sdf, const Model& model, Diagnostics& diagnostics) {
  std::vector<SensorDescription> described = read_sensors(*sdf.description, diagnostics);
  for (const SdfSensor& sensor : sdf.sensors) {
    std::optional<SensorDescription> read = read_sensor(sensor.node, sensor.link, diagnostics);
    if (!read) continue;
    read->X_LS = sensor.X_LS;
    read->joint = sensor.joint;
    described.push_back(std::move(*read));
  }
  return place_sensors(std::move(described), model, diagnostics);
}

RigSensor make_rig_sensor(const CompiledRobot& robot, const RobotSensor& sensor) {
  const bool prefixed = !robot.name_space().empty() && robot.asked().tf != TfTopics::separate;
  const std::string prefix = prefixed ? robot.name_space() + "/" : "";
  return {sensor.description,    robot.name(), sensor.link, robot.name_space(),
          prefix + sensor.frame, sensor.X_LF,  prefix};
}

}  // namespace doppel
