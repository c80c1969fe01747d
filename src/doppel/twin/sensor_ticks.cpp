#include "doppel/twin/detail/sensor_ticks.h"

#include <span>

#include "doppel/twin/pose_messages.h"
#include "doppel/twin/sensor_binding.h"

namespace doppel {
namespace {

constexpr Duration kListPeriod{1'000'000'000};

void add_sensors(const CompiledRobot& robot, std::vector<RigSensor>& out) {
  for (const RobotSensor& sensor : robot.sensors().sensors) out.push_back(make_rig_sensor(robot, sensor));
}

// Of a model that is no robot: its topics are as written, and its frames are below its name.
void add_sensors(const ModelSensors& model, std::vector<RigSensor>& out) {
  const std::string prefix = model.model + "/";
  for (const RobotSensor& sensor : model.sensors.sensors)
    out.push_back(
        {sensor.description, model.model, sensor.link, "", prefix + sensor.frame, sensor.X_LF, prefix});
}

}  // namespace

void SensorTicks::publish_frames(const std::vector<ModelSensors>& models) {
  constexpr const char* kModels = "/models";  // no namespace of a robot
  std::vector<geometry_msgs::msg::TransformStamped> transforms;
  for (const ModelSensors& model : models) {
    const int instance = scene_.engine().compiled()->find(model.model);
    if (!model.is_static || instance < 0) continue;
    for (const RobotSensor& sensor : model.sensors.sensors) {
      const Pose X_WL = scene_.engine().instance(instance).link_pose(sensor.link);
      const Pose X_TF = scene_.world_in_tf() * X_WL * sensor.X_LF;
      transforms.push_back(transform_of("world", model.model + "/" + sensor.frame, X_TF));
      transforms.back().header.stamp = to_time_msg(bus_.stamp(bus_.now()));
    }
  }
  sources_.statics->erase(kModels);
  if (transforms.empty()) return;
  if (!frames_node_) {
    frames_node_ = std::make_unique<Node>(bus_, "/doppel_models");
    tf_static_ =
        frames_node_->advertise<tf2_msgs::msg::TFMessage>("/tf_static", {.depth = 1, .latched = true});
  }
  (*sources_.statics)[kModels] = {this, std::move(transforms)};
  tf2_msgs::msg::TFMessage all;
  for (const auto& [name_space, of] : *sources_.statics)
    all.transforms.insert(all.transforms.end(), of.transforms.begin(), of.transforms.end());
  tf_static_.publish(all, bus_.now());
}

void SensorTicks::list_sensors() {
  list_.sensors.clear();
  for (RigStatus& one : light_.status()) list_.sensors.push_back(std::move(one.sensor));
  lights_ = list_.sensors.size();
  for (RigStatus& one : physical_.status()) list_.sensors.push_back(std::move(one.sensor));
  list_due_ = Time::min();
  if (list_.sensors.empty()) {
    list_node_.reset();
  } else if (!list_node_) {
    list_node_.emplace(bus_, "/doppel_sensors");
    list_topic_ =
        list_node_->advertise<doppel_msgs::msg::Sensors>("/doppel/sensors", {.depth = 1, .latched = true});
  }
}

void SensorTicks::look_up() {
  changed_ = false;
  std::vector<std::shared_ptr<const CompiledRobot>> present = sources_.robots();
  auto models = sources_.models();
  if (present == known_ && models == known_models_) {
    light_.instances_changed(scene_.engine());
    physical_.instances_changed(scene_.engine());
    return;
  }
  std::vector<RigSensor> sensors;
  for (const auto& robot : present) add_sensors(*robot, sensors);
  for (const ModelSensors& model : *models) add_sensors(model, sensors);
  physical_.set_earth(*sources_.earth);
  physical_.set_sensors(sensors, scene_.engine());
  light_.set_sensors(std::move(sensors), scene_.engine());
  publish_frames(*models);
  known_ = std::move(present);
  known_models_ = std::move(models);
  list_sensors();
}

void SensorTicks::between_steps(Time now) {
  if (changed_) look_up();
  light_.between_steps(now);
  physical_.between_steps(now);
  if (!list_node_ || now < list_due_) return;
  list_due_ = now + kListPeriod;
  const std::span<doppel_msgs::msg::Sensor> all(list_.sensors);
  light_.refresh(all.first(lights_));
  physical_.refresh(all.subspan(lights_));
  list_topic_.publish(list_, now);
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
