#include "doppel/scenario/compile/robot_sensors.h"

#include "doppel/description/gazebo/sensor_reader.h"
#include "doppel/scenario/compile/compiled_robot.h"

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
  return {.description = sensor.description,
          .instance = robot.name(),
          .link = sensor.link,
          .name_space = robot.name_space(),
          .frame = prefix + sensor.frame,
          .X_LF = sensor.X_LF,
          .frame_prefix = prefix,
          .origin_frame = prefix + sensor.description.link,
          .origin = sensor.description.X_LS.translation()};
}

}  // namespace doppel
