#include "doppel/devices/drivers/servo_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <numbers>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/base/math/quantity.h"
#include "doppel/base/packages/package_folder.h"
#include "doppel/base/yaml/placed_yaml.h"
#include "doppel/control/hardware/hardware_params.h"
#include "doppel/devices/drivers/detail/lerobot_calibration.h"
#include "doppel/devices/drivers/motion_guard.h"
#include "doppel/devices/frames/servo_line.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kLastId = 252;
const YamlRules kRules{"hardware.syntax", "hardware.unreadable", "hardware.too_large", "hardware.invalid",
                       "hardware.unknown_key"};

constexpr std::array<ServoPlugin, 8> kPlugins{{
    {"doppel/ServoLine", ServoProtocol::servo_line},
    {"doppel/FeetechSts", ServoProtocol::feetech},
    {"doppel/DynamixelX", ServoProtocol::dynamixel},
    {"omarm_hardware/OmArmSystem", ServoProtocol::servo_line},
    {"feetech_ros2_driver/FeetechHardwareInterface", ServoProtocol::feetech},
    {"feetech_sts_hardware/FeetechSTSHardware", ServoProtocol::feetech},
    {"dynamixel_hardware/DynamixelHardware", ServoProtocol::dynamixel},
    {"dynamixel_hardware_interface/DynamixelHardware", ServoProtocol::dynamixel},
}};

const std::vector<std::string> kComponentKeys{
    "port",          "rate",           "max_lost_replies", "fault_after",
    "torque",        "gripper_torque", "watchdog",         "fast_reads",
    "on_deactivate", "gentle",         "confirm_pose",     "park_on_exit",
    "pulse_min_us",  "pulse_max_us",   "travel_deg",       "gripper_travel_deg",
    "calibration"};
const std::vector<std::string> kJointKeys{"id",           "model",        "direction",  "offset_deg",
                                          "scale",        "enabled",      "gripper",    "zero_ticks",
                                          "pulse_min_us", "pulse_max_us", "travel_deg", "velocity"};

// Other drivers' names of these keys; empty: it has no meaning here.
struct Alias {
  std::string_view theirs, ours;
};
constexpr std::array<Alias, 26> kAliases{{{"usb_port", "port"},
                                          {"port_name", "port"},
                                          {"device", "port"},
                                          {"serial_port", "port"},
                                          {"baud_rate", "rate"},
                                          {"baudrate", "rate"},
                                          {"require_pose_confirmation", "confirm_pose"},
                                          {"connect_timeout_ms", ""},
                                          {"reply_timeout_ms", ""},
                                          {"error_timeout_ms", ""},
                                          {"use_dummy", ""},
                                          {"ID", "id"},
                                          {"channel", "id"},
                                          {"offset", "zero_ticks"},
                                          {"zero_offset", "zero_ticks"},
                                          {"servo_offset_deg", "offset_deg"},
                                          {"p_cofficient", ""},
                                          {"p_coefficient", ""},
                                          {"i_cofficient", ""},
                                          {"i_coefficient", ""},
                                          {"d_cofficient", ""},
                                          {"d_coefficient", ""},
                                          {"Position_P_Gain", ""},
                                          {"Position_I_Gain", ""},
                                          {"Position_D_Gain", ""},
                                          {"return_delay_time", ""}}};

std::vector<PlacedParam> translated(std::vector<PlacedParam> params, bool ours,
                                    const std::vector<std::string>& names) {
  std::vector<PlacedParam> out;
  for (PlacedParam& one : params) {
    const bool is_known = std::ranges::find(names, one.name) != names.end();
    const auto alias = std::ranges::find(kAliases, one.name, &Alias::theirs);
    if (is_known || ours || alias == kAliases.end()) {
      out.push_back(std::move(one));
    } else if (!alias->ours.empty()) {
      one.name = alias->ours;
      out.push_back(std::move(one));
    }
  }
  return out;
}

// The entries of a YAML map as params. Angles may have a unit: "offset: 12 deg" is offset_deg.
std::vector<PlacedParam> params_of(const PlacedYaml& map, const std::vector<std::string>& other_keys,
                                   Diagnostics& errors) {
  std::vector<PlacedParam> out;
  for (std::size_t i = 0; i < map.keys.size(); ++i) {
    const std::string& key = map.keys[i].text;
    const PlacedYaml& value = map.items[i];
    if (std::ranges::find(other_keys, key) != other_keys.end()) continue;
    if (!value.is_scalar()) {
      errors.error("hardware.invalid", value.where, fmt::format("'{}' must be one value", key));
      continue;
    }
    if (key != "offset") {
      out.push_back({key, value.text, map.keys[i].where});
      continue;
    }
    const auto angle = parse_quantity(value.text, QuantityKind::angle);
    if (!angle)
      errors.error("hardware.invalid", value.where, fmt::format("the offset '{}' is no angle", value.text),
                   "for example 12.5 deg");
    out.push_back({"offset_deg", fmt::format("{:.17g}", angle.value_or(0) / kDegree), map.keys[i].where});
  }
  return out;
}

class SetupReader {
 public:
  SetupReader(const HardwareDescription& description, const Model& model, Diagnostics& diagnostics)
      : description_(description), model_(model), diagnostics_(diagnostics) {}

  ServoSetup read() {
    out_.component = description_.name;
    const auto plugin = std::ranges::find(kPlugins, description_.plugin, &ServoPlugin::name);
    if (plugin != kPlugins.end()) out_.protocol = plugin->protocol;
    ours_ = description_.plugin.starts_with("doppel/");
    out_.file = hardware_file_of(description_);
    if (!out_.file.empty()) read_file();
    read_component();
    for (std::size_t i = 0; i < description_.joints.size(); ++i) read_joint(description_.joints[i], i);
    check_ids();
    check_recorded();
    read_park();
    errors_.throw_if_errors();
    return std::move(out_);
  }

 private:
  // The component's part of hardware.yaml.
  void read_file() {
    yaml_ = load_yaml(out_.file, kRules, "hardware file");
    if (!yaml_.is_map()) return;
    const PlacedYaml& part = yaml_[description_.name];
    if (!part) return;
    if (!part.is_map())
      return errors_.error("hardware.invalid", part.where,
                           fmt::format("'{}' must be a map", description_.name));
    file_params_ = params_of(part, {"joints", "park"}, errors_);
    park_ = part["park"];
    joints_ = part["joints"];
    if (!joints_.is_map()) return;
    std::vector<std::string> names;
    for (const HardwareJointDescription& joint : description_.joints) names.push_back(joint.name);
    for (const PlacedYaml& key : joints_.keys) {
      if (std::ranges::find(names, key.text) == names.end())
        errors_.error("hardware.unknown_joint", key.where,
                      fmt::format("'{}' has no joint '{}'{}", description_.name, key.text,
                                  did_you_mean(key.text, names)),
                      "use a joint of <ros2_control>");
    }
  }

  [[nodiscard]] HardwareParams joined_params(const std::string& what, std::vector<PlacedParam> first,
                                             const std::vector<std::pair<std::string, std::string>>& then,
                                             const SourceLocation& where,
                                             const std::vector<std::string>& names) {
    for (PlacedParam& one : placed_params(then, where)) first.push_back(std::move(one));
    return {what, translated(std::move(first), ours_, names), names, errors_};
  }

  void read_component() {
    HardwareParams params = joined_params(fmt::format("hardware '{}'", description_.name), file_params_,
                                          description_.params, description_.plugin_source, kComponentKeys);
    out_.port = params.text("port", "auto");
    constexpr int kMaxRate = 4'500'000;
    out_.rate = params.whole("rate", default_rate(out_.protocol), 9600, kMaxRate);
    out_.max_lost_replies = params.whole("max_lost_replies", out_.max_lost_replies, 1, 1000);
    out_.fault_after = params.number("fault_after", out_.fault_after, 0.02, 10);
    out_.torque = params.number("torque", out_.torque, 0.05, 1);
    out_.gripper_torque = params.number("gripper_torque", out_.gripper_torque, 0.05, 1);
    out_.watchdog = params.number("watchdog", out_.watchdog, 0.05, 5);
    out_.fast_reads = params.flag("fast_reads", out_.fast_reads);
    out_.at_deactivation =
        static_cast<AtDeactivation>(params.choice("on_deactivate", {"hold", "relax", "park"}, 0));
    out_.gentle = static_cast<GentleMode>(params.choice("gentle", {"until_checked", "always", "never"}, 0));
    out_.confirm_pose = params.flag("confirm_pose", true);
    out_.park_on_exit = params.flag("park_on_exit", false);
    pulse_min_ = params.number("pulse_min_us", 500, 100, 3000);
    pulse_max_ = params.number("pulse_max_us", 2500, 100, 3000);
    travel_ = params.number("travel_deg", 180, 10, 720) * kDegree;
    gripper_travel_ = params.number("gripper_travel_deg", travel_ / kDegree, 10, 720) * kDegree;
    if (pulse_min_ >= pulse_max_)
      params.report_problem("pulse_min_us", "pulse_min_us must be below pulse_max_us");
    const std::string calibration = params.text("calibration");
    if (calibration.empty()) return;
    if (out_.protocol != ServoProtocol::feetech)
      return params.report_problem("calibration", "a calibration of LeRobot is for Feetech's servos");
    const std::size_t before = errors_.all().size();
    recorded_ = read_recorded_motors(calibration, params.where("calibration"), errors_);
    recorded_is_whole_ = errors_.all().size() == before;
  }

  void read_joint(const HardwareJointDescription& joint, std::size_t index) {
    if (joint.command_interfaces.empty()) return;  // a mimic, or a joint that is only shown
    const int of_model = model_.find_joint(joint.name);
    if (of_model < 0) {
      std::vector<std::string> names;
      for (const ModelJoint& one : model_.joints) names.push_back(one.name);
      return errors_.error(
          "hardware.unknown_joint", joint.source,
          fmt::format("the robot has no joint '{}'{}", joint.name, did_you_mean(joint.name, names)));
    }
    const ModelJoint& limits = model_.joints[static_cast<std::size_t>(of_model)];
    std::vector<PlacedParam> first;
    if (joints_.is_map() && joints_[joint.name].is_map()) first = params_of(joints_[joint.name], {}, errors_);
    const auto recorded = std::ranges::find(recorded_, joint.name, &RecordedMotor::motor);
    const bool is_recorded = recorded != recorded_.end();
    const bool has_zero = std::ranges::any_of(
        first, [](const PlacedParam& one) { return one.name == "offset_deg" || one.name == "zero_ticks"; });
    if (is_recorded) {
      first.push_back({"id", std::to_string(recorded->id), recorded->where});
      first.push_back({"direction", recorded->drive_mode == 0 ? "1" : "-1", recorded->where});
    }
    HardwareParams params = joined_params(fmt::format("joint '{}'", joint.name), std::move(first),
                                          joint.params, joint.source, kJointKeys);
    JointServo servo;
    servo.joint = joint.name;
    servo.source = joint.source;
    servo.gripper = params.flag("gripper", looks_like_gripper(joint.name));
    read_mounting(params, servo, index);
    servo.lower = limits.lower;
    servo.upper = limits.upper;
    servo.velocity = params.number("velocity", limits.velocity, 1e-4, 1000);
    if (limits.velocity > 0) servo.velocity = std::min(servo.velocity, limits.velocity);
    servo.effort = limits.effort;
    if (is_recorded) take_recorded(*recorded, has_zero, servo);
    if (!std::isfinite(servo.velocity) || !(servo.velocity > 0))
      errors_.error(
          "hardware.no_velocity_limit", joint.source,
          fmt::format("the joint '{}' has no speed limit, so that nothing bounds its motion", joint.name),
          "write velocity=... into its <limit>, or velocity: 4 into hardware.yaml, in rad/s or m/s");
    for (const HardwareInterfaceDescription& one : joint.command_interfaces) {
      if (one.name != kPosition)
        errors_.error("hardware.interface", one.source,
                      fmt::format("servos have no {} command; '{}' can have position", one.name, joint.name));
    }
    out_.joints.push_back(std::move(servo));
  }

  void read_mounting(HardwareParams& params, JointServo& servo, std::size_t index) {
    const bool line = out_.protocol == ServoProtocol::servo_line;
    const int most = line ? static_cast<int>(kServoLineChannels) - 1 : kLastId;
    servo.id = params.whole("id", line ? static_cast<int>(index) : -1, 0, most);
    if (servo.id < 0)
      errors_.error(
          "hardware.no_id", servo.source, fmt::format("the joint '{}' has no id of its servo", servo.joint),
          "doppel hardware scan lists the ids; write <param name=\"id\">1</param>, or id in hardware.yaml");
    if (!line) {
      const std::string name =
          params.text("model", out_.protocol == ServoProtocol::feetech ? "STS3215" : "XL430-W250");
      servo.model = find_servo_model(name);
      if (servo.model == nullptr || servo.model->protocol != out_.protocol) {
        std::vector<std::string> names;
        for (const ServoModel& one : servo_models()) {
          if (one.protocol == out_.protocol) names.emplace_back(one.name);
        }
        params.report_problem("model", fmt::format("unknown servo '{}'{}", name, did_you_mean(name, names)));
        servo.model = find_servo_model(names.front());
      }
    }
    const int direction = params.whole("direction", 1, -1, 1);
    if (direction == 0) params.report_problem("direction", "direction is 1 or -1");
    servo.direction = direction < 0 ? -1 : 1;
    servo.scale = params.number("scale", 1, 0.01, 100);
    servo.enabled = params.flag("enabled", true);
    servo.calibrated = params.has("offset_deg") || params.has("zero_ticks");
    servo.offset = params.number("offset_deg", 0, -360, 360) * kDegree;
    if (params.has("zero_ticks") && servo.model != nullptr)
      servo.offset = servo.model->angle(params.whole("zero_ticks", 0, -32767, 32767));
    if (!line) return;
    servo.pulse_min = params.number("pulse_min_us", pulse_min_, 100, 3000);
    servo.pulse_max = params.number("pulse_max_us", pulse_max_, 100, 3000);
    const double travel = servo.gripper ? gripper_travel_ : travel_;
    servo.travel = params.number("travel_deg", travel / kDegree, 10, 720) * kDegree;
    // A hobby servo's description counts from the end of its travel, as 0 to 180 degrees.
    if (!servo.calibrated) servo.offset = -servo.direction * servo.travel / 2;
  }

  // LeRobot's zero of an angle is the middle of the recorded range. Its gripper goes from 0 to 100 %, so that
  // the middles of the range and of the joint's limits are the same pose. What hardware.yaml has of the joint
  // wins.
  void take_recorded(const RecordedMotor& recorded, bool has_zero, JointServo& servo) {
    servo.recorded = {recorded.homing_offset, recorded.range_min, recorded.range_max};
    const double low = servo.model->angle(recorded.range_min), high = servo.model->angle(recorded.range_max);
    const bool bounded = std::isfinite(servo.lower) && std::isfinite(servo.upper);
    if (!has_zero) {
      servo.offset = (low + high) / 2;
      if (servo.gripper && bounded)
        servo.offset -= servo.direction * servo.scale * (servo.lower + servo.upper) / 2;
    }
    servo.calibrated = true;
    const double whole = servo.upper - servo.lower;
    const auto [lower, upper] = std::minmax({servo.joint_position(low), servo.joint_position(high)});
    servo.lower = std::max(servo.lower, lower);
    servo.upper = std::min(servo.upper, upper);
    if (servo.lower >= servo.upper)
      return errors_.error(
          "calibration.outside", recorded.where,
          fmt::format("the recorded range of '{}' is outside of the joint's limits", servo.joint),
          "its offset in hardware.yaml, or calibrate again");
    constexpr double kSwept = 0.7;
    if (bounded && servo.upper - servo.lower < kSwept * whole)
      diagnostics_.warning(
          "calibration.narrow", recorded.where,
          fmt::format(
              "the calibration has {:.0f} of the {:.0f} degrees of '{}', which the joint cannot leave",
              (servo.upper - servo.lower) / kDegree, whole / kDegree, servo.joint),
          "calibrate again, and move each joint through its whole range");
  }

  void check_recorded() {
    if (recorded_.empty()) return;
    std::vector<std::string> motors, joints;
    for (const RecordedMotor& one : recorded_) motors.push_back(one.motor);
    for (const JointServo& one : out_.joints) joints.push_back(one.joint);
    for (const RecordedMotor& one : recorded_) {
      if (std::ranges::find(joints, one.motor) == joints.end())
        errors_.error("calibration.unknown_joint", one.where,
                      fmt::format("'{}' has no joint '{}'{}", description_.name, one.motor,
                                  did_you_mean(one.motor, joints)),
                      "the calibration of another arm? its motors are named as the joints");
    }
    for (const JointServo& one : out_.joints) {
      if (recorded_is_whole_ && std::ranges::find(motors, one.joint) == motors.end())
        errors_.error(
            "calibration.missing_joint", recorded_.front().where,
            fmt::format("the calibration has no motor '{}'{}", one.joint, did_you_mean(one.joint, motors)),
            "calibrate again with all motors of the arm");
    }
  }

  void check_ids() {
    std::map<int, const JointServo*> seen;
    for (const JointServo& one : out_.joints) {
      if (one.id < 0) continue;
      const auto [before, fresh] = seen.emplace(one.id, &one);
      if (!fresh)
        errors_.error("hardware.id_twice", one.source,
                      fmt::format("the joints '{}' and '{}' have the same id {}", before->second->joint,
                                  one.joint, one.id),
                      "each servo of a bus needs an id of its own");
    }
    for (const JointServo& one : out_.joints) {
      if (!one.calibrated)
        diagnostics_.warning("hardware.uncalibrated", one.source,
                             fmt::format("direction and zero of the servo of '{}' are assumed", one.joint),
                             "doppel hardware nudge finds the direction, doppel calibrate --live the zero");
    }
  }

  void read_park() {
    if (!park_) {
      if (out_.at_deactivation == AtDeactivation::park || out_.park_on_exit)
        errors_.error("hardware.no_park", description_.plugin_source,
                      fmt::format("hardware '{}' parks, and has no park pose", description_.name),
                      "write park: {JOINT: 90 deg, ...} into hardware.yaml");
      return;
    }
    for (std::size_t i = 0; i < park_.keys.size(); ++i) {
      const PlacedYaml& value = park_.items[i];
      const auto angle =
          value.is_scalar() ? parse_quantity(value.text, QuantityKind::position) : std::nullopt;
      if (!angle)
        errors_.error("hardware.invalid", value.where, "a position of the park pose is an angle or a length",
                      "for example 90 deg");
      out_.park.emplace_back(park_.keys[i].text, angle.value_or(0));
    }
  }

  const HardwareDescription& description_;
  const Model& model_;
  Diagnostics& diagnostics_;
  Diagnostics errors_;
  ServoSetup out_;
  bool ours_ = true;
  PlacedYaml yaml_, joints_, park_;
  std::vector<PlacedParam> file_params_;
  std::vector<RecordedMotor> recorded_;
  bool recorded_is_whole_ = true;  // without entries that are skipped
  double pulse_min_ = 0, pulse_max_ = 0, travel_ = 0, gripper_travel_ = 0;
};

}  // namespace

std::span<const ServoPlugin> servo_plugins() {
  return kPlugins;
}

bool is_servo_plugin(std::string_view plugin) {
  return std::ranges::find(kPlugins, plugin, &ServoPlugin::name) != kPlugins.end();
}

int default_rate(ServoProtocol protocol) {
  switch (protocol) {
    case ServoProtocol::feetech:
      return 1'000'000;
    case ServoProtocol::dynamixel:
      return 57'600;
    case ServoProtocol::servo_line:
      break;
  }
  return 115'200;
}

fs::path hardware_file_of(const HardwareDescription& description) {
  if (!description.source.known()) return {};
  const fs::path package = package_around(*description.source.file);
  const fs::path folder =
      package.empty() ? fs::path(*description.source.file).parent_path() : package / "config";
  const fs::path file = folder / "hardware.yaml";
  std::error_code failed;
  return fs::is_regular_file(file, failed) ? file : fs::path{};
}

const JointServo& servo_named(const ServoSetup& setup, const std::string& joint) {
  const auto servo = std::ranges::find(setup.joints, joint, &JointServo::joint);
  if (servo != setup.joints.end()) return *servo;
  std::vector<std::string> names;
  for (const JointServo& one : setup.joints) names.push_back(one.joint);
  throw InputError("hardware.unknown_joint", {},
                   fmt::format("no servo drives '{}'{}", joint, did_you_mean(joint, names)));
}

ServoSetup read_servo_setup(const HardwareDescription& description, const Model& model,
                            Diagnostics& diagnostics) {
  return SetupReader(description, model, diagnostics).read();
}

}  // namespace doppel
