#include "doppel/scenario/compile/simulated_hardware.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "doppel/base/core/names.h"
#include "doppel/scenario/compile/detail/mock_parameters.h"

namespace doppel {
namespace {

constexpr std::size_t kNoSensor = std::numeric_limits<std::size_t>::max();

}  // namespace

void register_simulated_hardware(HardwareRegistry& registry, Instance robot) {
  for (const SimulatorPlugin& plugin : simulator_plugins()) {
    registry.add(std::string(plugin.name), HardwareKind::simulated,
                 [robot] { return std::make_unique<SimulatedHardware>(robot); });
  }
}

SimulatedHardware::Quantity SimulatedHardware::quantity_of(const std::string& interface) {
  if (interface == kPosition) return Quantity::position;
  if (interface == kVelocity) return Quantity::velocity;
  if (interface == kEffort) return Quantity::effort;
  return Quantity::constant;
}

Status SimulatedHardware::on_init(const HardwareInfo& info) {
  for (const auto& [name, value] : info.description.params) {
    if (name != "unclaimed") continue;  // other parameters are those of the replaced plugin
    const std::vector<std::string> known{"free", "hold", "brake"};
    const auto found = std::find(known.begin(), known.end(), value);
    if (found == known.end()) {
      throw InputError("ros2_control.unclaimed", info.description.source,
                       fmt::format("hardware '{}' has unclaimed: '{}'{}", info.description.name, value,
                                   did_you_mean(value, known)),
                       "write free, hold or brake");
    }
    unclaimed_ = std::array{PassiveJoint::free, PassiveJoint::hold,
                            PassiveJoint::brake}[static_cast<std::size_t>(found - known.begin())];
  }
  for (const HardwareJointDescription& joint : info.description.joints) add_joint(joint, info);
  for (const HardwareJointDescription& sensor : info.description.sensors) add_sensor(sensor);
  bind_states();
  for (const HardwareJointDescription& part : info.description.gpios) add_part(part);
  return {};
}

void SimulatedHardware::add_joint(const HardwareJointDescription& joint, const HardwareInfo& info) {
  const Model& model = info.model;
  const std::string& name = info.description.name;
  Diagnostics& diagnostics = info.diagnostics;
  const int index = model.find_joint(joint.name);
  if (index < 0) {
    std::vector<std::string> names;
    for (const ModelJoint& known : model.joints) names.push_back(known.name);
    diagnostics.warning(
        "ros2_control.unknown_joint", joint.source,
        fmt::format(
            "<ros2_control> '{}' lists the joint '{}', which the robot does not have; it is ignored{}", name,
            joint.name, did_you_mean(joint.name, names)),
        "use the name of the <joint> element, or remove the entry");
    return;
  }
  const ModelJoint& target = model.joints[static_cast<std::size_t>(index)];
  if (!target.scalar()) {
    diagnostics.warning("ros2_control.fixed_joint", joint.source,
                        fmt::format("<ros2_control> '{}' lists '{}', which does not have exactly one degree "
                                    "of freedom; it is ignored",
                                    name, joint.name),
                        "list revolute, continuous and prismatic joints only");
    return;
  }
  for (const HardwareInterfaceDescription& state : joint.state_interfaces) {
    states_.push_back(
        {{joint.name, state.name, state.initial_value.value_or(0.0)}, index, quantity_of(state.name)});
  }
  for (const HardwareInterfaceDescription& command : joint.command_interfaces) {
    if (target.mimics()) {
      diagnostics.warning(
          "ros2_control.mimic_commanded", command.source,
          fmt::format("'{}' mimics '{}' and cannot be commanded; its {} command interface is ignored",
                      joint.name, model.joints[static_cast<std::size_t>(target.mimic_leader)].name,
                      command.name),
          "remove the <command_interface>, or the <mimic>");
      continue;
    }
    if (quantity_of(command.name) == Quantity::constant) {
      diagnostics.warning("ros2_control.unknown_interface", command.source,
                          fmt::format("the simulated '{}' has no command interface '{}' (position, velocity "
                                      "and effort exist); it is ignored",
                                      joint.name, command.name));
      continue;
    }
    commands_.push_back({{joint.name, command.name, std::nan("")}, index, quantity_of(command.name)});
    if (std::find(driven_.begin(), driven_.end(), index) == driven_.end()) driven_.push_back(index);
  }
}

void SimulatedHardware::use_sensors(const SensorBindings& bindings,
                                    std::unique_ptr<SensorReadings> readings) {
  if (readings) {
    readings->bind(robot_.engine());
    if (readings_) readings->resume(*readings_, robot_.engine().time());
  }
  bound_ = bindings.values;
  sensors_ = bindings.sensors.size();
  readings_ = std::move(readings);
  bind_states();
}

// Before on_init() there are no states yet.
void SimulatedHardware::bind_states() {
  for (std::size_t part = 0; part < std::min(first_states_.size(), bound_.size()); ++part) {
    for (std::size_t i = 0; i < bound_[part].size(); ++i) {
      Interface& state = states_[first_states_[part] + i];
      // What was bound before an edit and no longer is reads its initial value again.
      if (!bound_[part][i] && state.quantity != Quantity::sensor) continue;
      state.quantity = Quantity::sensor;
      state.sensed = bound_[part][i].value_or(SensorValue{kNoSensor, 0});
    }
  }
}

void SimulatedHardware::add_sensor(const HardwareJointDescription& sensor) {
  first_states_.push_back(states_.size());
  add_part(sensor);
  for (std::size_t i = 0; i < sensor.state_interfaces.size(); ++i)
    states_[first_states_.back() + i].description.initial =
        sensor.state_interfaces[i].initial_value.value_or(std::nan(""));
}

void SimulatedHardware::add_part(const HardwareJointDescription& part) {
  for (const HardwareInterfaceDescription& state : part.state_interfaces) {
    states_.push_back({{part.name, state.name, state.initial_value.value_or(0.0)}, -1, Quantity::constant});
  }
  for (const HardwareInterfaceDescription& command : part.command_interfaces) {
    commands_.push_back(
        {{part.name, command.name, command.initial_value.value_or(std::nan(""))}, -1, Quantity::constant});
  }
}

void SimulatedHardware::rebind(Instance robot) {
  robot_ = robot;
  if (readings_) readings_->bind(robot_.engine());
  choose_drives();
}

std::vector<InterfaceDescription> SimulatedHardware::state_interfaces() const {
  std::vector<InterfaceDescription> out;
  for (const Interface& i : states_) out.push_back(i.description);
  return out;
}

std::vector<InterfaceDescription> SimulatedHardware::command_interfaces() const {
  std::vector<InterfaceDescription> out;
  for (const Interface& i : commands_) out.push_back(i.description);
  return out;
}

Status SimulatedHardware::on_activate() {
  forget_efforts();  // of the time before, in which they were not read
  active_ = true;
  choose_drives();
  return {};
}

Status SimulatedHardware::on_deactivate() {
  active_ = stopped_ = false;
  for (Interface& i : commands_) i.claimed = false;
  choose_drives();
  return {};
}

// Each joint is held at its present position, regardless of the target of its drive.
void SimulatedHardware::on_stop() {
  stopped_ = true;
  // A drive takes the present position as its target when its mode changes to position, so that all pass
  // through passive first.
  for (const int joint : driven_) robot_.set_drive(joint, DriveMode::passive);
  choose_drives();
}

void SimulatedHardware::on_stop_reset() {
  stopped_ = false;
  choose_drives();
}

Status SimulatedHardware::prepare_switch(std::span<const std::string> start,
                                         std::span<const std::string> /*stop*/) {
  for (const Interface& i : commands_) {
    if (std::find(start.begin(), start.end(), i.description.full_name()) == start.end()) continue;
    // A drive has one target: with a position, the other two are limits or feedforward of other hardware
    // and are ignored; velocity and effort without it contradict each other.
    const bool velocity_with_effort =
        i.quantity == Quantity::velocity &&
        std::find(start.begin(), start.end(), i.description.prefix + "/" + kEffort) != start.end() &&
        std::find(start.begin(), start.end(), i.description.prefix + "/" + kPosition) == start.end();
    if (velocity_with_effort) {
      return Status::refused(
          fmt::format("'{}' cannot be commanded by velocity and effort at once; claim one of them",
                      i.description.prefix));
    }
  }
  return {};
}

void SimulatedHardware::perform_switch(std::span<const std::string> start,
                                       std::span<const std::string> stop) {
  for (Interface& i : commands_) {
    const std::string full = i.description.full_name();
    if (std::find(stop.begin(), stop.end(), full) != stop.end()) i.claimed = false;
    if (std::find(start.begin(), start.end(), full) != start.end()) i.claimed = true;
  }
  choose_drives();
}

bool SimulatedHardware::save(SavedSlot& slot) const {
  Saved& out = value_in<Saved>(slot);
  out.claimed.clear();
  for (const Interface& command : commands_) out.claimed.push_back(command.claimed);
  out.efforts.clear();
  for (const Interface& state : states_) out.efforts.push_back(state.effort);
  out.active = active_;
  out.stopped = stopped_;
  if (readings_) readings_->save(out.readings);
  return true;
}

void SimulatedHardware::restore(const SavedPart& saved) {
  const Saved* const before = value_of<Saved>(&saved);
  if (before == nullptr || before->claimed.size() != commands_.size()) return;
  for (std::size_t i = 0; i < commands_.size(); ++i) commands_[i].claimed = before->claimed[i];
  for (std::size_t i = 0; i < std::min(states_.size(), before->efforts.size()); ++i)
    states_[i].effort = before->efforts[i];
  active_ = before->active;
  stopped_ = before->stopped;
  if (readings_ && before->readings) readings_->restore(*before->readings);
}

void SimulatedHardware::choose_drives() {
  for (const int joint : driven_) {
    const DriveMode mode = drive_of(joint);
    if (robot_.drive(joint) != mode) robot_.set_drive(joint, mode);
  }
}

DriveMode SimulatedHardware::drive_of(int joint) const {
  if (stopped_) return DriveMode::position;
  DriveMode mode = DriveMode::passive;
  for (const Interface& i : commands_) {
    if (i.joint != joint || !i.claimed) continue;
    if (i.quantity == Quantity::position) mode = DriveMode::position;
    if (i.quantity == Quantity::velocity && mode != DriveMode::position) mode = DriveMode::velocity;
    if (i.quantity == Quantity::effort && mode == DriveMode::passive) mode = DriveMode::effort;
  }
  if (mode != DriveMode::passive || !active_) return mode;
  if (unclaimed_ == PassiveJoint::hold) return DriveMode::position;
  return unclaimed_ == PassiveJoint::brake ? DriveMode::velocity : DriveMode::passive;
}

void SimulatedHardware::after_step() {
  const auto effort = robot_.drive_effort();
  for (Interface& state : states_) {
    if (state.quantity != Quantity::effort) continue;
    state.effort.sum += effort[static_cast<std::size_t>(state.joint)];
    ++state.effort.steps;
  }
}

void SimulatedHardware::forget_efforts() {
  for (Interface& state : states_) state.effort = {};
}

HardwareReturn SimulatedHardware::read(Time /*now*/, Duration /*period*/, std::span<double> states) {
  const auto q = robot_.q();
  const auto v = robot_.v();
  const auto effort = robot_.drive_effort();
  if (readings_) readings_->read(robot_.engine());
  for (std::size_t i = 0; i < states_.size(); ++i) {
    Interface& s = states_[i];
    const auto j = static_cast<std::size_t>(s.joint);
    switch (s.quantity) {
      case Quantity::sensor:
        states[i] = s.sensed.sensor < sensors_ ? readings_->values(s.sensed.sensor)[s.sensed.value]
                                               : s.description.initial;
        break;
      case Quantity::position:
        states[i] = q[static_cast<std::size_t>(robot_.model().joints[j].q)];
        break;
      case Quantity::velocity:
        states[i] = v[static_cast<std::size_t>(robot_.model().joints[j].v)];
        break;
      case Quantity::effort:
        if (s.effort.steps > 0) s.effort = {0, 0, s.effort.sum / s.effort.steps};
        states[i] = std::isfinite(s.effort.mean) ? s.effort.mean : effort[j];
        break;
      case Quantity::constant:
        break;
    }
  }
  return HardwareReturn::ok;
}

HardwareReturn SimulatedHardware::write(Time /*now*/, Duration /*period*/, std::span<const double> commands) {
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    const Interface& c = commands_[i];
    if (!c.claimed || c.joint < 0 || !std::isfinite(commands[i])) continue;
    const DriveMode mode = robot_.drive(c.joint);
    // A joint has one drive: of several claimed interfaces, the one that the last switch chose sets the
    // target.
    const bool drives = (c.quantity == Quantity::position && mode == DriveMode::position) ||
                        (c.quantity == Quantity::velocity && mode == DriveMode::velocity) ||
                        (c.quantity == Quantity::effort && mode == DriveMode::effort);
    if (drives) robot_.set_target(c.joint, nearest_turn(c, commands[i]));
  }
  return HardwareReturn::ok;
}

// A continuous joint takes the shortest way, because whole turns are the same position.
double SimulatedHardware::nearest_turn(const Interface& command, double value) const {
  const ModelJoint& joint = robot_.model().joints[static_cast<std::size_t>(command.joint)];
  if (joint.type != JointType::continuous || command.quantity != Quantity::position) return value;
  const double q = robot_.q()[static_cast<std::size_t>(joint.q)];
  return q + std::remainder(value - q, 2.0 * std::numbers::pi);
}

HardwareDescription generated_hardware(const Model& model) {
  HardwareDescription hardware;
  hardware.name = "GeneratedSystem";
  hardware.type = "system";
  hardware.plugin = kSimulatedPlugin;
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar()) continue;
    HardwareJointDescription entry;
    entry.name = joint.name;
    // A joint that mimics has no drive of its own; it follows its leader.
    if (!joint.mimics()) {
      for (const char* name : {kPosition, kVelocity, kEffort})
        entry.command_interfaces.emplace_back().name = name;
    }
    for (const char* name : {kPosition, kVelocity, kEffort})
      entry.state_interfaces.emplace_back().name = name;
    hardware.joints.push_back(std::move(entry));
  }
  return hardware;
}

void report_emulated(const HardwareDescription& hardware, Diagnostics& diagnostics) {
  diagnostics.note("ros2_control.plugin_emulated", hardware.plugin_source,
                   fmt::format("the devices of '{}' are emulated; no port is opened", hardware.plugin));
}

void report_plugin(const HardwareDescription& hardware, PluginUse use, Diagnostics& diagnostics) {
  if (use == PluginUse::real) {
    diagnostics.note("ros2_control.plugin_real", hardware.plugin_source,
                     fmt::format("'{}' drives real hardware here; it is not simulated", hardware.plugin));
    return;
  }
  if (use == PluginUse::driver) {
    diagnostics.note("ros2_control.plugin_simulated", hardware.plugin_source,
                     fmt::format("'{}' drives real hardware; it is simulated here", hardware.plugin),
                     "use_sim:=false drives the devices; of servos, --emulate drives emulated ones");
    return;
  }
  if (find_simulator_plugin(hardware.plugin) != nullptr) {
    if (hardware.plugin != kSimulatedPlugin) {
      diagnostics.note(
          "ros2_control.plugin_mapped", hardware.plugin_source,
          fmt::format("'{}' is the plugin of another simulator; doppel's simulated hardware replaces it",
                      hardware.plugin));
    }
    if (hardware.plugin.ends_with("_components/GenericSystem")) report_mock_parameters(hardware, diagnostics);
    return;
  }
  std::vector<std::string> known;
  for (const SimulatorPlugin& plugin : simulator_plugins()) known.emplace_back(plugin.name);
  const auto near = nearest_name(hardware.plugin, known);
  if (hardware.plugin.empty()) {
    diagnostics.warning("ros2_control.no_plugin", hardware.source,
                        fmt::format("<ros2_control> '{}' has no <plugin>; it is simulated", hardware.name));
  } else if (near) {
    diagnostics.warning("ros2_control.plugin_typo", hardware.plugin_source,
                        fmt::format("'{}' is not a known plugin; did you mean '{}'? It is simulated",
                                    hardware.plugin, *near));
  } else {
    diagnostics.note("ros2_control.plugin_simulated", hardware.plugin_source,
                     fmt::format("doppel has no driver '{}'; it is simulated", hardware.plugin),
                     fmt::format("for hardware: {}", kWaysToHardware));
  }
}

void apply_initial_values(const RobotDescription& robot, const Model& model, Eigen::VectorXd& q,
                          Diagnostics& diagnostics) {
  for (const HardwareDescription& hardware : robot.hardware) {
    for (const HardwareJointDescription& entry : hardware.joints) {
      const int index = model.find_joint(entry.name);
      if (index < 0 || !model.joints[static_cast<std::size_t>(index)].scalar()) continue;
      const ModelJoint& joint = model.joints[static_cast<std::size_t>(index)];
      for (const HardwareInterfaceDescription& state : entry.state_interfaces) {
        if (state.name != kPosition || !state.initial_value) continue;
        const double wanted = *state.initial_value;
        const double value = std::clamp(wanted, joint.lower, joint.upper);
        if (value != wanted) {
          diagnostics.warning(
              "ros2_control.initial_value_outside", state.source,
              fmt::format("the initial_value {} of '{}' is outside its limits [{}, {}]; it starts at {}",
                          wanted, joint.name, joint.lower, joint.upper, value),
              "choose an initial_value inside the joint's <limit>");
        }
        q[joint.q] = value;
      }
    }
  }
  model.apply_mimics(q);
}

}  // namespace doppel
