#include "doppel/twin/detail/sensor_ticks.h"

namespace doppel {
namespace {

void add_sensors(const CompiledRobot& robot, std::vector<RigSensor>& out) {
  const bool prefixed = !robot.name_space().empty() && robot.asked().tf != TfTopics::separate;
  for (const RobotSensor& sensor : robot.sensors().sensors)
    out.push_back({sensor.description, robot.name(), sensor.link, robot.name_space(),
                   (prefixed ? robot.name_space() + "/" : "") + sensor.frame, sensor.X_LF});
}

}  // namespace

void SensorTicks::look_up() {
  changed_ = false;
  std::vector<std::shared_ptr<const CompiledRobot>> present = robots_();
  if (present == known_) {
    rig_.instances_changed(scene_.engine());
    return;
  }
  std::vector<RigSensor> sensors;
  for (const auto& robot : present) add_sensors(*robot, sensors);
  rig_.set_sensors(std::move(sensors), scene_.engine());
  known_ = std::move(present);
}

}  // namespace doppel
