#include "doppel/twin/detail/sensor_ticks.h"

namespace doppel {
namespace {

void add_sensors(const CompiledRobot& robot, std::vector<RigSensor>& out) {
  const bool prefixed = !robot.name_space().empty() && robot.asked().tf != TfTopics::separate;
  const std::string prefix = prefixed ? robot.name_space() + "/" : "";
  for (const RobotSensor& sensor : robot.sensors().sensors)
    out.push_back({sensor.description, robot.name(), sensor.link, robot.name_space(), prefix + sensor.frame,
                   sensor.X_LF, prefix});
}

constexpr Duration kListPeriod{1'000'000'000};

}  // namespace

void SensorTicks::look_up() {
  changed_ = false;
  std::vector<std::shared_ptr<const CompiledRobot>> present = robots_();
  if (present == known_) {
    light_.instances_changed(scene_.engine());
    physical_.instances_changed(scene_.engine());
    return;
  }
  std::vector<RigSensor> sensors;
  for (const auto& robot : present) add_sensors(*robot, sensors);
  physical_.set_sensors(sensors, scene_.engine());
  light_.set_sensors(std::move(sensors), scene_.engine());
  known_ = std::move(present);
  list_due_ = Time::min();
  if (light_.empty() && physical_.empty()) {
    list_.reset();
  } else if (!list_) {
    list_.emplace(bus_, "/doppel_sensors");
    topic_ = list_->advertise<doppel_msgs::msg::Sensors>("/doppel/sensors", {.depth = 1, .latched = true});
  }
}

void SensorTicks::between_steps(Time now) {
  light_.between_steps(now);
  physical_.between_steps(now);
  if (!list_ || now < list_due_) return;
  list_due_ = now + kListPeriod;
  doppel_msgs::msg::Sensors list;
  for (RigStatus& one : status()) list.sensors.push_back(std::move(one.sensor));
  topic_.publish(list, now);
}

void SensorTicks::reset(Time now) {
  light_.reset(now);
  physical_.reset(scene_.engine());
  list_due_ = now;
}

std::vector<RigStatus> SensorTicks::status() const {
  std::vector<RigStatus> out = light_.status();
  for (RigStatus& one : physical_.status()) out.push_back(std::move(one));
  return out;
}

}  // namespace doppel
