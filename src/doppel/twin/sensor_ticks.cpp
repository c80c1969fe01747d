#include "doppel/twin/detail/sensor_ticks.h"

#include "doppel/twin/pose_messages.h"

namespace doppel {
namespace {

void add_sensors(const CompiledRobot& robot, std::vector<RigSensor>& out) {
  const bool prefixed = !robot.name_space().empty() && robot.asked().tf != TfTopics::separate;
  for (const RobotSensor& sensor : robot.sensors().sensors)
    out.push_back({sensor.description, robot.name(), sensor.link, robot.name_space(),
                   (prefixed ? robot.name_space() + "/" : "") + sensor.frame, sensor.X_LF});
}

// Of a model that is no robot: its topics are as written, and its frames are below its name.
void add_sensors(const ModelSensors& model, std::vector<RigSensor>& out) {
  for (const RobotSensor& sensor : model.sensors.sensors)
    out.push_back(
        {sensor.description, model.model, sensor.link, "", model.model + "/" + sensor.frame, sensor.X_LF});
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
  if (!node_) {
    node_ = std::make_unique<Node>(bus_, "/doppel_models");
    tf_static_ = node_->advertise<tf2_msgs::msg::TFMessage>("/tf_static", {.depth = 1, .latched = true});
  }
  (*sources_.statics)[kModels] = {this, std::move(transforms)};
  tf2_msgs::msg::TFMessage all;
  for (const auto& [name_space, of] : *sources_.statics)
    all.transforms.insert(all.transforms.end(), of.transforms.begin(), of.transforms.end());
  tf_static_.publish(all, bus_.now());
}

void SensorTicks::instances_changed() {
  std::vector<std::shared_ptr<const CompiledRobot>> present = sources_.robots();
  auto models = sources_.models();
  if (present == known_ && models == known_models_) {
    rig_.instances_changed(scene_.engine());
    return;
  }
  std::vector<RigSensor> sensors;
  for (const auto& robot : present) add_sensors(*robot, sensors);
  for (const ModelSensors& model : *models) add_sensors(model, sensors);
  rig_.set_sensors(std::move(sensors), scene_.engine());
  publish_frames(*models);
  known_ = std::move(present);
  known_models_ = std::move(models);
}

}  // namespace doppel
