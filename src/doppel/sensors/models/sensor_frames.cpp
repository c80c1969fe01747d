#include "doppel/sensors/models/sensor_frames.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/description/gazebo/sensor_reader.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

constexpr double kSame = 1e-4;  // m, rad

bool same(const Pose& a, const Pose& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff() < kSame;
}

// Chooses the frame of one sensor after the other.
class FrameFinder {
 public:
  FrameFinder(const Model& model, Diagnostics& diagnostics, RobotSensors& out)
      : model_(model), diagnostics_(diagnostics), out_(out), data_(model) {
    forward_kinematics(model, data_, model.neutral());
  }

  void choose(RobotSensor& sensor) {
    const bool pictures = std::holds_alternative<std::vector<CameraDescription>>(sensor.description.what);
    Pose X_LS = sensor.description.X_LS;
    if (pictures)
      X_LS = X_LS * std::get<std::vector<CameraDescription>>(sensor.description.what).front().X_SC *
             optical_axes();
    if (!sensor.description.frame.empty() && take_named(sensor, X_LS, pictures)) return;
    const std::string& link = sensor.description.link;
    if (!pictures && same(X_LS, Pose::Identity())) {
      sensor.frame = link;
      return;
    }
    sensor.X_LF = X_LS;
    sensor.frame = free_name(pictures ? link + "_optical_frame" : sensor.description.name + "_frame", sensor);
  }

 private:
  // A frame by the user's name: kept as it is.
  bool take_named(RobotSensor& sensor, const Pose& X_LS, bool pictures) {
    const std::string& name = sensor.description.frame;
    const int frame = model_.find_link(name);
    const auto added = std::find_if(out_.frames.begin(), out_.frames.end(),
                                    [&](const FixedFrame& f) { return f.name == name; });
    if (frame < 0 && added == out_.frames.end()) {
      if (sensor.description.frame_is_optical) {
        out_.frames.push_back({name, sensor.description.link, X_LS});
        sensor.X_LF = X_LS;
        sensor.frame = name;
        return true;
      }
      std::vector<std::string> links;
      for (const ModelLink& link : model_.links) links.push_back(link.name);
      diagnostics_.warning(
          "sensor.frame", sensor.description.source,
          fmt::format("the sensor '{}' names the frame '{}', which is not in TF{}; another frame is used",
                      sensor.description.name, name, did_you_mean(name, links)));
      return false;
    }
    sensor.frame = name;
    sensor.X_LF = frame >= 0 ? data_.X_WL[static_cast<std::size_t>(sensor.link)].inverse() *
                                   data_.X_WL[static_cast<std::size_t>(frame)]
                             : added->X_PF;
    if (pictures && !same_axes(sensor.X_LF, X_LS) && frame >= 0)
      diagnostics_.warning(
          "sensor.frame", sensor.description.source,
          fmt::format(
              "the pictures of '{}' name the frame '{}', whose axes are not optical (z forward, x to the "
              "right), so that tools show them turned",
              sensor.description.name, name),
          fmt::format("name an optical frame by <optical_frame_id>, or leave out the frame: then "
                      "{}_optical_frame is published",
                      sensor.description.link));
    return true;
  }

  static bool same_axes(const Pose& a, const Pose& b) {
    return (a.linear() - b.linear()).cwiseAbs().maxCoeff() < kSame;
  }

  // `wanted` if it is a link there, or free; else with the sensor's name. Adds the frame if it is new.
  std::string free_name(const std::string& wanted, const RobotSensor& sensor) {
    for (const std::string& name : {wanted, sensor.description.name + "_" + wanted}) {
      const int link = model_.find_link(name);
      if (link >= 0) {
        const Pose X_LF = data_.X_WL[static_cast<std::size_t>(sensor.link)].inverse() *
                          data_.X_WL[static_cast<std::size_t>(link)];
        if (same(X_LF, sensor.X_LF)) return name;
        continue;
      }
      const auto added = std::find_if(out_.frames.begin(), out_.frames.end(),
                                      [&](const FixedFrame& f) { return f.name == name; });
      if (added != out_.frames.end()) {
        if (added->parent == sensor.description.link && same(added->X_PF, sensor.X_LF)) return name;
        continue;
      }
      out_.frames.push_back({name, sensor.description.link, sensor.X_LF});
      return name;
    }
    const std::string name =
        fmt::format("{}_{}_frame{}", sensor.description.link, sensor.description.name, out_.frames.size());
    out_.frames.push_back({name, sensor.description.link, sensor.X_LF});
    return name;
  }

  const Model& model_;
  Diagnostics& diagnostics_;
  RobotSensors& out_;
  Data data_;
};

}  // namespace

Pose optical_axes() {
  Pose X = Pose::Identity();
  X.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return X;
}

RobotSensors place_sensors(std::vector<SensorDescription> described, const Model& model,
                           Diagnostics& diagnostics) {
  RobotSensors out;
  if (described.empty()) return out;
  FrameFinder frames(model, diagnostics, out);
  for (SensorDescription& description : described) {
    RobotSensor sensor;
    sensor.link = model.find_link(description.link);
    sensor.description = std::move(description);
    if (sensor.link < 0) continue;
    frames.choose(sensor);
    out.sensors.push_back(std::move(sensor));
  }
  return out;
}

RobotSensors find_sensors(const RobotDescription& robot, const Model& model, Diagnostics& diagnostics) {
  return place_sensors(read_sensors(robot, diagnostics), model, diagnostics);
}

}  // namespace doppel
