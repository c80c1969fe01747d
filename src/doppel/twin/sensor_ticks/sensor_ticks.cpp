#include "doppel/twin/sensor_ticks/sensor_ticks.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <span>

#include "doppel/scenario/compile/robot_sensors.h"
#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel {
namespace {

constexpr Duration kListPeriod{1'000'000'000};
constexpr std::size_t kLongestMessage = 80;
constexpr Duration kFramePeriod{20'000'000};  // of /tf, as robot_state_publisher's default

void add_sensors(const CompiledRobot& robot, std::vector<RigSensor>& out) {
  for (const RobotSensor& sensor : robot.sensors().sensors) out.push_back(make_rig_sensor(robot, sensor));
}

// Of a model that is no robot: its topics are as written, and its frames are below its name.
void add_sensors(const ModelSensors& model, std::vector<RigSensor>& out) {
  const std::string prefix = model.model + "/";
  for (const RobotSensor& sensor : model.sensors.sensors)
    out.push_back({.description = sensor.description,
                   .instance = model.model,
                   .link = sensor.link,
                   .name_space = "",
                   .frame = prefix + sensor.frame,
                   .X_LF = sensor.X_LF,
                   .frame_prefix = prefix,
                   .origin_frame = prefix + sensor.frame,  // of its links, TF has those of sensors only
                   .origin = sensor.X_LF.inverse() * sensor.description.X_LS.translation()});
}

}  // namespace

SensorTicks::SensorTicks(TwinCore& core)
    : core_(core),
      light_(core.bus(), core.log(), core.scenario().sensors),
      physical_(core.bus(), core.log(), core.scenario().sensors) {
  light_.set_ranges(core.ranges());
  look_up();
}

void SensorTicks::find_frames(const std::vector<ModelSensors>& models) {
  constexpr const char* kModels = "/models";  // no namespace of a robot
  std::vector<geometry_msgs::msg::TransformStamped> still;
  std::vector<std::pair<std::string, std::string>> wrench_frames;  // by sensor: also those of links
  for (const RigStatus& one : physical_.status())
    wrench_frames.emplace_back(one.sensor.name, one.sensor.frame);
  moving_.clear();
  moving_message_.transforms.clear();
  for (const ModelSensors& model : models) {
    const int instance = scene_.engine().compiled()->find(model.model);
    if (instance < 0) continue;
    const std::string prefix = model.model + "/";
    const auto add = [&](const std::string& name, int link, const Pose& X_LF) {
      const MovingFrame frame{model.model, instance, link, X_LF};
      auto& transforms = model.is_static ? still : moving_message_.transforms;
      const auto has_name = [&](const auto& other) { return other.child_frame_id == name; };
      if (std::any_of(transforms.begin(), transforms.end(), has_name)) return;
      transforms.push_back(transform_of("world", name, pose_of(frame)));
      transforms.back().header.stamp = to_time_msg(bus_.stamp(bus_.now()));
      if (!model.is_static) moving_.push_back(frame);
    };
    for (const RobotSensor& sensor : model.sensors.sensors)
      add(prefix + sensor.frame, sensor.link, sensor.X_LF);
    const Model& made_of = *scene_.engine().instance(instance).made_of().model;
    for (const auto& [name, frame] : wrench_frames)
      if (name.starts_with(prefix) && frame.starts_with(prefix))
        if (const int link = made_of.find_link(frame.substr(prefix.size())); link >= 0)
          add(frame, link, Pose::Identity());
  }
  frames_due_ = Time::min();
  core_.statics()->erase(kModels);
  if (still.empty() && moving_.empty()) {
    frames_node_.reset();
    return;
  }
  if (!frames_node_) {
    frames_node_ = std::make_unique<Node>(bus_, "/doppel_models");
    tf_static_ =
        frames_node_->advertise<tf2_msgs::msg::TFMessage>("/tf_static", {.depth = 1, .latched = true});
    tf_ = frames_node_->advertise<tf2_msgs::msg::TFMessage>("/tf", {.depth = 100});
  }
  if (still.empty()) return;
  (*core_.statics())[kModels] = {this, std::move(still)};
  tf2_msgs::msg::TFMessage all;
  for (const auto& [name_space, of] : *core_.statics())
    all.transforms.insert(all.transforms.end(), of.transforms.begin(), of.transforms.end());
  tf_static_.publish(all, bus_.now());
}

Pose SensorTicks::pose_of(const MovingFrame& frame) const {
  return scene_.world_in_tf() * scene_.engine().instance(frame.instance).link_pose(frame.link) * frame.X_LF;
}

void SensorTicks::publish_moving(Time now) {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    if (moving_[i].instance < 0) continue;
    auto& transform = moving_message_.transforms[i];
    transform.header.stamp = to_time_msg(bus_.stamp(now));
    write_transform(pose_of(moving_[i]), transform.transform);
  }
  tf_.publish(moving_message_, now);
}

void SensorTicks::list_sensors() {
  list_.sensors.clear();
  for (RigStatus& one : light_.status()) list_.sensors.push_back(std::move(one.sensor));
  lights_ = list_.sensors.size();
  for (RigStatus& one : physical_.status()) list_.sensors.push_back(std::move(one.sensor));
  list_due_ = Time::min();
  report_shared_topics();
  if (list_.sensors.empty()) {
    list_node_.reset();
  } else if (!list_node_) {
    list_node_.emplace(bus_, "/doppel_sensors");
    list_topic_ =
        list_node_->advertise<doppel_msgs::msg::Sensors>("/doppel/sensors", {.depth = 1, .latched = true});
    diagnostics_topic_ =
        list_node_->advertise<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", {.depth = 1});
  }
  diagnostics_.status.clear();
  left_out_before_.clear();
  failed_before_.clear();
  for (const auto& sensor : std::span(list_.sensors).first(lights_)) {
    diagnostic_msgs::msg::DiagnosticStatus status;
    status.name = "doppel: sensor " + sensor.name;
    status.hardware_id = sensor.frame;
    status.message.reserve(kLongestMessage);
    for (const char* key : {"rate asked, Hz", "rate reached, Hz", "samples", "left out"})
      status.values.push_back({key, ""});
    diagnostics_.status.push_back(std::move(status));
    left_out_before_.push_back(sensor.left_out);
    failed_before_.push_back(light_.failed(failed_before_.size()));
  }
}

void SensorTicks::write_diagnostics() {
  using diagnostic_msgs::msg::DiagnosticStatus;
  const auto write = [](std::string& out, auto value) {  // short enough for a string without memory
    out.clear();
    fmt::format_to(std::back_inserter(out), "{:.6g}", static_cast<double>(value));
  };
  for (std::size_t i = 0; i < lights_; ++i) {
    const doppel_msgs::msg::Sensor& sensor = list_.sensors[i];
    DiagnosticStatus& status = diagnostics_.status[i];
    const std::uint64_t left_out = sensor.left_out - left_out_before_[i];
    left_out_before_[i] = sensor.left_out;
    const std::uint64_t failed = light_.failed(i) - failed_before_[i];
    failed_before_[i] += failed;
    status.level = failed > 0     ? DiagnosticStatus::ERROR
                   : left_out > 0 ? DiagnosticStatus::WARN
                                  : DiagnosticStatus::OK;
    status.message.clear();
    if (failed > 0)
      status.message = "fails; the log says why";
    else if (left_out > 0)
      fmt::format_to(std::back_inserter(status.message),
                     "{} samples left out since the last message: too slow", left_out);
    else
      status.message = sensor.reached > 0 ? "publishes" : "is not read";
    write(status.values[0].value, sensor.rate);
    write(status.values[1].value, sensor.reached);
    write(status.values[2].value, sensor.samples);
    write(status.values[3].value, sensor.left_out);
  }
}

// Of a reload or a spawn only what it has changed.
void SensorTicks::report_shared_topics() {
  std::map<std::string, std::vector<std::string>> of_topic;
  for (const auto& sensor : list_.sensors)
    for (const std::string& topic : sensor.topics) of_topic[topic].push_back(sensor.name);
  std::set<std::string> present;
  for (const auto& [topic, names] : of_topic) {
    if (names.size() < 2) continue;
    std::string text = fmt::format(
        "{} publish on the same topic {}, so that their readers get both; give "
        "each a topic of its own, as in <topic>{}/image</topic>",
        fmt::join(names, ", "), topic, names.front().substr(names.front().rfind('/') + 1));
    if (!shared_.contains(text)) log_.warning("sensors", text);
    present.insert(std::move(text));
  }
  shared_ = std::move(present);
}

void SensorTicks::number_revisions(std::vector<RigSensor>& sensors) {
  ++revision_;
  for (RigSensor& sensor : sensors) {
    // A sensor whose values have not changed keeps its number, so that its samples continue over a reload.
    const auto same = std::find_if(numbered_.begin(), numbered_.end(),
                                   [&](const RigSensor& before) { return same_values(before, sensor); });
    sensor.revision = same != numbered_.end() ? same->revision : revision_;
  }
  numbered_ = sensors;
}

void SensorTicks::look_up() {
  changed_ = false;
  std::vector<std::shared_ptr<const CompiledRobot>> present;
  for (const auto& robot : core_.robots()) present.push_back(robot->shared_machine());
  auto models = core_.machine().model_sensors;
  // The sensors are the same: only the numbers of their instances in the engine may have changed.
  if (present == known_ && models == known_models_) {
    light_.instances_changed(scene_.engine());
    physical_.instances_changed(scene_.engine());
    for (MovingFrame& frame : moving_) frame.instance = scene_.engine().compiled()->find(frame.model);
    return;
  }
  std::vector<RigSensor> sensors;
  for (const auto& robot : present) add_sensors(*robot, sensors);
  for (const ModelSensors& model : *models) add_sensors(model, sensors);
  number_revisions(sensors);
  physical_.set_earth(*core_.earth());
  physical_.set_sensors(sensors, scene_.engine(), [this] { light_.release_topics(); });
  light_.set_sensors(sensors, scene_.engine());
  find_frames(*models);
  known_ = std::move(present);
  known_models_ = std::move(models);
  list_sensors();
}

void SensorTicks::between_steps(Time now) {
  if (changed_) look_up();
  light_.between_steps(now);
  physical_.between_steps(now);
  if (!moving_.empty() && now >= frames_due_) {
    frames_due_ = now + kFramePeriod;
    publish_moving(now);
  }
  // Once a second: the list of sensors with what they have published since, and their diagnostics.
  if (!list_node_ || now < list_due_) return;
  list_due_ = now + kListPeriod;
  const std::span<doppel_msgs::msg::Sensor> all(list_.sensors);
  light_.refresh(all.first(lights_));
  physical_.refresh(all.subspan(lights_));
  list_topic_.publish(list_, now);
  if (lights_ == 0 || !diagnostics_topic_.has_listeners()) return;
  write_diagnostics();
  diagnostics_.header.stamp = to_time_msg(bus_.stamp(now));
  diagnostics_topic_.publish(diagnostics_, now);
}

void SensorTicks::reset(Time now) {
  light_.reset(now);
  physical_.reset(scene_.engine());
  list_due_ = frames_due_ = now;
}

namespace {

struct SavedSensorTicks {
  SavedSlot light, physical;
  Time frames_due{}, list_due{};
  std::vector<std::uint64_t> left_out_before, failed_before;
};

}  // namespace

void SensorTicks::save(SavedSlot& slot) {
  SavedSensorTicks& out = value_in<SavedSensorTicks>(slot);
  if (changed_) look_up();
  light_.save(out.light);
  physical_.save(out.physical);
  out.frames_due = frames_due_;
  out.list_due = list_due_;
  out.left_out_before = left_out_before_;
  out.failed_before = failed_before_;
}

void SensorTicks::restore(const SavedPart* saved, Time /*now*/) {
  const auto* const before = value_of<SavedSensorTicks>(saved);
  if (before == nullptr) return;
  if (changed_) look_up();
  light_.restore(*before->light);
  physical_.restore(*before->physical);
  frames_due_ = before->frames_due;
  list_due_ = before->list_due;
  if (before->left_out_before.size() == left_out_before_.size()) {
    left_out_before_ = before->left_out_before;
    failed_before_ = before->failed_before;
  }
}

std::vector<RigStatus> SensorTicks::status() const {
  std::vector<RigStatus> out = light_.status();
  for (RigStatus& one : physical_.status()) out.push_back(std::move(one));
  return out;
}

}  // namespace doppel
