#include "doppel/control/manager/test/fake_hardware.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "doppel/control/hardware/nan.h"

namespace doppel {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

std::size_t index_of(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? kNone : static_cast<std::size_t>(found - names.begin());
}

}  // namespace

FakeHardware::FakeHardware(FakeHardwareOptions options) : options_(std::move(options)) {
  names_ = options_.joints;
  names_.insert(names_.end(), options_.state_only_joints.begin(), options_.state_only_joints.end());
  joints_.resize(names_.size());
  for (const std::string& name : names_) {
    for (const std::string& state : options_.states) states_.push_back({name, state, 0.0});
  }
  for (const std::string& name : options_.joints) {
    for (const std::string& command : options_.commands) commands_.push_back({name, command, kNaN});
  }
  states_.insert(states_.end(), options_.more_states.begin(), options_.more_states.end());
  commands_.insert(commands_.end(), options_.more_commands.begin(), options_.more_commands.end());
  for (const auto& state : states_) {
    state_joint_.push_back(index_of(names_, state.prefix));
    extra_.push_back(state.initial);
  }
  for (const auto& command : commands_) command_joint_.push_back(index_of(options_.joints, command.prefix));
  last_.assign(commands_.size(), kNaN);
  at_release_ = last_;
  claimed_.assign(commands_.size(), false);
}

HardwareDescription FakeHardware::description() const {
  HardwareDescription out;
  out.name = options_.name;
  out.type = "system";
  out.plugin = "doppel/FakeSystem";
  out.rw_rate = options_.rw_rate;
  return out;
}

bool FakeHardware::save(SavedSlot& slot) const {
  value_in<Saved>(slot) = {joints_, last_, extra_, at_release_, claimed_};
  return true;
}

void FakeHardware::restore(const SavedPart& saved) {
  const Saved* const before = value_of<Saved>(&saved);
  if (before == nullptr) return;
  joints_ = before->joints;
  last_ = before->last;
  extra_ = before->extra;
  at_release_ = before->at_release;
  claimed_ = before->claimed;
}

Status FakeHardware::called(const char* what) {
  calls.emplace_back(what);
  if (throw_in == what) throw std::runtime_error("lost the port");
  return {};
}

Status FakeHardware::on_init(const HardwareInfo& /*info*/) {
  return called("on_init");
}
Status FakeHardware::on_configure() {
  return called("on_configure");
}
Status FakeHardware::on_cleanup() {
  return called("on_cleanup");
}
Status FakeHardware::on_shutdown() {
  return called("on_shutdown");
}
void FakeHardware::on_stop() {
  static_cast<void>(called("on_stop"));
}
void FakeHardware::on_stop_reset() {
  static_cast<void>(called("on_stop_reset"));
}

Status FakeHardware::on_activate() {
  if (!refuse_activation.empty()) return Status::refused(refuse_activation);
  Status status = called("on_activate");
  active = true;
  return status;
}

Status FakeHardware::on_deactivate() {
  active = false;
  return called("on_deactivate");
}

Status FakeHardware::on_error() {
  active = false;
  static_cast<void>(called("on_error"));
  return refuse_recovery ? Status::refused("it is burnt") : Status{};
}

Status FakeHardware::prepare_switch(std::span<const std::string> /*start*/,
                                    std::span<const std::string> /*stop*/) {
  return refuse_switch.empty() ? Status{} : Status::refused(refuse_switch);
}

void FakeHardware::perform_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  if (throw_in == "perform_switch") throw std::runtime_error("lost the port");
  const auto mark = [this](std::span<const std::string> names, bool claimed_now, const char* sign) {
    for (const std::string& full_name : names) {
      switches.push_back(sign + full_name);
      for (std::size_t i = 0; i < commands_.size(); ++i) {
        if (commands_[i].full_name() != full_name) continue;
        claimed_[i] = claimed_now;
        if (!claimed_now) at_release_[i] = last_[i];
      }
    }
  };
  mark(stop, false, "-");
  mark(start, true, "+");
}

HardwareReturn FakeHardware::read(Time /*now*/, Duration /*period*/, std::span<double> states) {
  ++reads;
  if (throw_in == "read") throw std::runtime_error("lost the port");
  if (read_answer != HardwareReturn::ok) return read_answer;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (state_joint_[i] == kNone) {
      states[i] = extra_[i];
      continue;
    }
    const Joint& j = joints_[state_joint_[i]];
    const std::string& what = states_[i].name;
    if (what == kPosition) states[i] = j.position + j.offset;
    if (what == kVelocity) states[i] = j.velocity;
    if (what == kAcceleration) states[i] = j.acceleration;
    if (what == kEffort) states[i] = j.effort;
  }
  return HardwareReturn::ok;
}

void FakeHardware::follow(Joint& j, const std::string& interface, double command, double dt) const {
  if (interface == kEffort) j.effort = command;
  if (interface == kAcceleration) j.acceleration = command;
  if (j.blocked) {
    j.velocity = 0;
    return;
  }
  const double share = options_.time_constant > 0 ? 1 - std::exp(-dt / options_.time_constant) : 1;
  if (interface == kPosition) {
    const double before = j.position;
    j.position += share * (command - j.position);
    if (dt > 0) j.velocity = (j.position - before) / dt;
  }
  if (interface == kVelocity) {
    j.velocity += share * (command - j.velocity);
    // If the position is commanded as well, it takes precedence and the velocity is only a feed-forward.
    const bool position_leads =
        std::find(options_.commands.begin(), options_.commands.end(), kPosition) != options_.commands.end();
    if (!position_leads) j.position += j.velocity * dt;
  }
}

HardwareReturn FakeHardware::write(Time /*now*/, Duration period, std::span<const double> commands) {
  ++writes;
  if (throw_in == "write") throw std::runtime_error("lost the port");
  if (write_answer != HardwareReturn::ok) return write_answer;
  const double dt = to_seconds(period);
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    last_[i] = commands[i];
    if (!claimed_[i] || !std::isfinite(commands[i])) continue;
    if (command_joint_[i] != kNone) {
      follow(joints_[command_joint_[i]], commands_[i].name, commands[i], dt);
      continue;
    }
    for (std::size_t s = 0; s < states_.size(); ++s) {
      if (states_[s].prefix == commands_[i].prefix && states_[s].name == commands_[i].name)
        extra_[s] = commands[i];
    }
  }
  return HardwareReturn::ok;
}

FakeHardware::Joint& FakeHardware::joint(const std::string& joint_name) {
  const std::size_t i = index_of(names_, joint_name);
  if (i == kNone) throw std::logic_error("the fake hardware has no joint '" + joint_name + "'");
  return joints_[i];
}

const FakeHardware::Joint& FakeHardware::joint(const std::string& joint_name) const {
  return const_cast<FakeHardware*>(this)->joint(joint_name);
}

void FakeHardware::set_position(const std::string& joint_name, double position) {
  joint(joint_name).position = position;
}
void FakeHardware::set_velocity(const std::string& joint_name, double velocity) {
  joint(joint_name).velocity = velocity;
}
void FakeHardware::set_offset(const std::string& joint_name, double offset) {
  joint(joint_name).offset = offset;
}
void FakeHardware::block(const std::string& joint_name, bool blocked) {
  joint(joint_name).blocked = blocked;
}
double FakeHardware::position(const std::string& joint_name) const {
  return joint(joint_name).position;
}
double FakeHardware::velocity(const std::string& joint_name) const {
  return joint(joint_name).velocity;
}

double FakeHardware::last_command(const std::string& full_name) const {
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    if (commands_[i].full_name() == full_name) return last_[i];
  }
  throw std::logic_error("the fake hardware has no command interface '" + full_name + "'");
}

double FakeHardware::command_at_release(const std::string& full_name) const {
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    if (commands_[i].full_name() == full_name) return at_release_[i];
  }
  throw std::logic_error("the fake hardware has no command interface '" + full_name + "'");
}

bool FakeHardware::claimed(const std::string& full_name) const {
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    if (commands_[i].full_name() == full_name) return claimed_[i];
  }
  return false;
}

}  // namespace doppel
