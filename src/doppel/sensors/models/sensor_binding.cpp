#include "doppel/sensors/models/sensor_binding.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "doppel/base/core/names.h"
#include "doppel/sensors/models/reading_names.h"

namespace doppel {
namespace {

constexpr const char* kUnbound = "ros2_control.sensor_unbound";
constexpr const char* kRange = "range";
using Names = std::vector<std::string>;

bool is_in(const Names& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

std::size_t common(const Names& a, const Names& b) {
  return static_cast<std::size_t>(std::ranges::count_if(a, [&](const auto& name) { return is_in(b, name); }));
}

SensorDescription ideal(const char* type, decltype(SensorDescription::what) what) {
  SensorDescription out;
  out.type = type;
  out.what = std::move(what);
  return out;
}

EnvironmentDescription environment(EnvironmentKind kind) {
  EnvironmentDescription out;
  out.kind = kind;
  return out;
}

// Without noise, of each kind that has values; the first of two that fit as well is meant.
std::array<SensorDescription, 7> ideal_sensors() {
  ImuDescription imu;
  imu.reference = OrientationReference::world_enu;
  return {ideal("imu", imu),
          ideal("pose", environment(EnvironmentKind::pose)),
          ideal("force_torque", ForceTorqueDescription{}),
          ideal("navsat", environment(EnvironmentKind::navsat)),
          ideal("magnetometer", environment(EnvironmentKind::magnetometer)),
          ideal("altimeter", environment(EnvironmentKind::altimeter)),
          ideal("air_pressure", environment(EnvironmentKind::air_pressure))};
}

// The place where a <param> puts a sensor.
struct Place {
  std::string written;  // <param name="link">hand</param>
  std::string name;     // hand
  int link = -1;        // -1: there is no such link or joint
  std::string joint;
  Pose X_LS = Pose::Identity();
  Names known;  // names that could be meant
};

class Binder {
 public:
  Binder(const HardwareDescription& hardware, const Model& model, const RobotSensors& sensors)
      : hardware_(hardware), model_(model), sensors_(sensors) {}

  SensorBindings bind() {
    for (const HardwareJointDescription& part : hardware_.sensors) bind(part);
    return std::move(out_);
  }

 private:
  void bind(const HardwareJointDescription& part) {
    Names wanted;
    for (const HardwareInterfaceDescription& state : part.state_interfaces) wanted.push_back(state.name);
    auto& values = out_.values.emplace_back(wanted.size());
    const std::optional<RobotSensor> sensor = find(part, wanted);
    if (!sensor) return;
    const Names offered = reading_names(sensor->description);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const auto found = std::ranges::find(offered, wanted[i]);
      if (found != offered.end())
        values[i] = SensorValue{out_.sensors.size(), static_cast<std::size_t>(found - offered.begin())};
      else if (!part.state_interfaces[i].initial_value)
        report(part.state_interfaces[i].source,
               fmt::format(
                   "the interface '{}/{}' reads NaN: the sensor '{}' of the type '{}' has no such value{}",
                   part.name, wanted[i], sensor->description.name, sensor->description.type,
                   did_you_mean(wanted[i], offered)),
               fmt::format("use {}", fmt::join(offered, ", ")));
    }
    out_.sensors.push_back(*sensor);
  }

  std::optional<RobotSensor> find(const HardwareJointDescription& part, const Names& wanted) {
    const RobotSensor* named = nullptr;
    std::size_t most = 0;
    const RobotSensor* unfit = nullptr;
    for (const RobotSensor& sensor : sensors_.sensors) {
      if (sensor.description.name != part.name) continue;
      const std::size_t fits = common(wanted, reading_names(sensor.description));
      if (fits > most) {
        named = &sensor;
        most = fits;
      } else if (fits == 0) {
        unfit = &sensor;
      }
    }
    if (named != nullptr) return *named;
    return place(part, wanted, unfit);
  }

  // A sensor of its own at the place that a <param> names.
  std::optional<RobotSensor> place(const HardwareJointDescription& part, const Names& wanted,
                                   const RobotSensor* unfit) {
    const auto kinds = ideal_sensors();
    const auto* const kind = std::ranges::max_element(
        kinds, {}, [&](const SensorDescription& one) { return common(wanted, reading_names(one)); });
    const bool known = common(wanted, reading_names(*kind)) > 0;
    if (!known && is_constant(part)) return std::nullopt;
    const std::optional<Place> at = place_of(part);
    if (!known && at && is_in(wanted, kRange))
      if (const RobotSensor* const range = find_range(*at)) return *range;
    if (!known || !at || at->link < 0) {
      report_unbound(part, known ? kind->type : is_in(wanted, kRange) ? "sonar" : "", at, unfit);
      return std::nullopt;
    }
    RobotSensor sensor;
    sensor.description = *kind;
    sensor.description.name = part.name;
    sensor.description.joint = at->joint;
    sensor.description.link = model_.links[static_cast<std::size_t>(at->link)].name;
    sensor.description.X_LS = sensor.X_LF = at->X_LS;
    sensor.description.source = part.source;
    sensor.link = at->link;
    sensor.frame = sensor.description.link;
    if (kind->type == "force_torque" && sensor.link <= base_link()) {
      report_unbound(part, kind->type, at, unfit);
      return std::nullopt;
    }
    return sensor;
  }

  // Ranges are measured by a sensor of the description only: the one with this frame, or on this link. nullptr: none.
  [[nodiscard]] const RobotSensor* find_range(const Place& at) const {
    const RobotSensor* on_link = nullptr;
    for (const RobotSensor& sensor : sensors_.sensors) {
      if (!std::holds_alternative<RangeDescription>(sensor.description.what)) continue;
      if (sensor.frame == at.name) return &sensor;
      if (sensor.link == at.link && on_link == nullptr) on_link = &sensor;
    }
    return on_link;
  }

  // No joint of the description carries it; a floating base is beyond the joint that compile_model() adds.
  [[nodiscard]] int base_link() const {
    return !model_.joints.empty() && model_.joints.front().type == JointType::floating ? 1 : 0;
  }

  static bool is_constant(const HardwareJointDescription& part) {
    return std::ranges::all_of(part.state_interfaces,
                               [](const auto& state) { return state.initial_value.has_value(); });
  }

  [[nodiscard]] std::optional<Place> place_of(const HardwareJointDescription& part) const {
    for (const char* key : {"joint", "link", "frame_id"}) {
      for (const auto& [name, value] : part.params) {
        if (name != key) continue;
        Place out;
        out.written = fmt::format("<param name=\"{}\">{}</param>", name, value);
        out.name = value;
        if (name == "joint") {
          for (const ModelJoint& joint : model_.joints) out.known.push_back(joint.name);
          const int joint = model_.find_joint(value);
          if (joint >= 0) out.link = model_.joints[static_cast<std::size_t>(joint)].child_link;
          out.joint = value;
          return out;
        }
        for (const ModelLink& link : model_.links) out.known.push_back(link.name);
        out.link = model_.find_link(value);
        for (const FixedFrame& frame : sensors_.frames) {
          out.known.push_back(frame.name);
          if (out.link >= 0 || frame.name != value) continue;
          out.link = model_.find_link(frame.parent);
          out.X_LS = frame.X_PF;
        }
        return out;
      }
    }
    return std::nullopt;
  }

  void report_unbound(const HardwareJointDescription& part, const std::string& type,
                      const std::optional<Place>& at, const RobotSensor* unfit) {
    Names names;
    for (const RobotSensor& sensor : sensors_.sensors)
      if (!reading_names(sensor.description).empty()) names.push_back(sensor.description.name);
    std::string why = unfit != nullptr
                          ? fmt::format("the sensor '{}' of the description has the type '{}'", part.name,
                                        unfit->description.type)
                          : "the description has no sensor of this name" + did_you_mean(part.name, names);
    if (at && at->link < 0) {
      why += fmt::format(", and {} names nothing of the robot{}", at->written,
                         did_you_mean(at->name, at->known));
    } else if (at && type == "sonar") {
      why += fmt::format(", and no range sensor is at what {} names", at->written);
    } else if (at) {
      why += fmt::format(", and no joint carries what {} names", at->written);
    }
    const char* const param = type == "force_torque" ? "<param name=\"joint\">JOINT</param>"
                                                     : "<param name=\"frame_id\">LINK</param>";
    std::string fix = type.empty()
                          ? "write <param name=\"initial_value\"> in each <state_interface> for constants"
                          : fmt::format(
                                "add <gazebo reference=\"LINK\"><sensor name=\"{}\" type=\"{}\">, or write "
                                "{} in the <sensor>",
                                part.name, type, param);
    const bool constant = is_constant(part);
    out_.unbound.add({constant ? Severity::warning : Severity::error, kUnbound,
                      fmt::format("the sensor '{}' of <ros2_control> {}: {}", part.name,
                                  constant ? "keeps its initial values" : "reads NaN", why),
                      part.source, std::move(fix)});
  }

  void report(const SourceLocation& where, std::string message, std::string fix) {
    out_.unbound.error(kUnbound, where, std::move(message), std::move(fix));
  }

  const HardwareDescription& hardware_;
  const Model& model_;
  const RobotSensors& sensors_;
  SensorBindings out_;
};

}  // namespace

SensorBindings bind_sensors(const HardwareDescription& hardware, const Model& model,
                            const RobotSensors& sensors) {
  return Binder(hardware, model, sensors).bind();
}

}  // namespace doppel
