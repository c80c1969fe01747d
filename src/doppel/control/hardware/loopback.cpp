#include "doppel/control/hardware/detail/loopback.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "doppel/control/hardware/hardware_params.h"
#include "doppel/control/hardware/nan.h"

namespace doppel {
namespace {

constexpr std::array kQuantities{kPosition, kVelocity, kAcceleration, kEffort};
constexpr std::size_t kPositionIndex = 0, kVelocityIndex = 1;

std::size_t quantity(const std::string& interface) {
  const auto found = std::find(kQuantities.begin(), kQuantities.end(), interface);
  return static_cast<std::size_t>(found - kQuantities.begin());  // the size: none of them
}

}  // namespace

void Loopback::read_parameters(const HardwareInfo& info) {
  Diagnostics errors;
  HardwareParams params(
      fmt::format("hardware '{}'", name_),
      placed_params(info.description.params, info.description.plugin_source),
      {"delay", "unclaimed", "fault", "fault_at", "fault_for", "fault_in", "fault_size", "recovers"}, errors);
  delay_ = params.number("delay", 0.0, 0.0, kInfinity);
  unclaimed_ = std::array{PassiveJoint::hold, PassiveJoint::free,
                          PassiveJoint::brake}[params.choice("unclaimed", {"hold", "free", "brake"}, 0)];
  fault_ = static_cast<Fault>(
      params.choice("fault", {"none", "late", "wrong", "nan", "silent", "error", "deactivate", "throw"}, 0));
  fault_at_ = std::llround(params.number("fault_at", 1, 1, kInfinity));
  fault_for_ = std::llround(params.number("fault_for", 0, 0, kInfinity));
  fault_in_write_ = params.choice("fault_in", {"read", "write"}, 0) == 1;
  fault_size_ = params.number("fault_size", fault_ == Fault::late ? 0.02 : 1.0, 0.0, kInfinity);
  recovers_ = params.flag("recovers", true);
  errors.throw_if_errors();
}

void Loopback::add(const HardwareJointDescription& source) {
  Part part;
  part.name = source.name;
  std::vector<std::pair<std::string, std::size_t>> others;  // commands of none of the four quantities
  for (const HardwareInterfaceDescription& command : source.command_interfaces) {
    const std::size_t kind = quantity(command.name);
    (kind < kQuantities.size() ? part.commands[kind] : others.emplace_back(command.name, 0).second) =
        commands_.size();
    commands_.push_back({source.name, command.name, command.initial_value.value_or(kNaN)});
  }
  for (const HardwareInterfaceDescription& state : source.state_interfaces) {
    const std::size_t kind = quantity(state.name);
    const double initial = state.initial_value.value_or(0.0);
    if (kind < kQuantities.size()) {
      part.states[kind] = states_.size();
      part.values[kind] = initial;
    }
    for (const auto& [name, command] : others) {
      if (name == state.name) mirrors_.emplace_back(states_.size(), command);
    }
    states_.push_back({source.name, state.name, initial});
  }
  parts_.push_back(std::move(part));
}

Status Loopback::on_init(const HardwareInfo& info) {
  name_ = info.description.name;
  read_parameters(info);
  for (const auto* parts : {&info.description.joints, &info.description.sensors, &info.description.gpios}) {
    for (const HardwareJointDescription& part : *parts) add(part);
  }
  claimed_.assign(commands_.size(), false);
  // The delay is a ring of whole periods; one more than the delay, for the commands of the present period.
  const auto steps = static_cast<std::size_t>(std::llround(delay_ * info.rw_rate));
  pending_.assign(steps + 1, std::vector<double>(commands_.size(), kNaN));
  return {};
}

Status Loopback::on_activate() {
  reads_ = writes_ = 0;
  halt();
  return {};
}

Status Loopback::on_deactivate() {
  halt();
  return {};
}

void Loopback::halt() {
  // NaN is no command: a joint whose delayed commands are gone keeps its position.
  for (auto& commands : pending_) std::fill(commands.begin(), commands.end(), kNaN);
  for (Part& part : parts_) part.values[kVelocityIndex] = 0.0;
}

Status Loopback::on_error() {
  halt();
  std::fill(claimed_.begin(), claimed_.end(), false);
  return recovers_ ? Status{} : Status::refused("its <param> 'recovers' is false");
}

void Loopback::perform_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    const std::string name = commands_[i].full_name();
    const bool starts = std::find(start.begin(), start.end(), name) != start.end();
    const bool stops = std::find(stop.begin(), stop.end(), name) != stop.end();
    if (starts || stops) claimed_[i] = starts;
    // Delayed commands of an earlier controller must not reach a joint that is claimed anew; a controller
    // that takes a joint over continues with them.
    if (!starts || stops) continue;
    for (auto& commands : pending_) commands[i] = kNaN;
  }
}

void Loopback::on_stop() {
  halt();
}

bool Loopback::save(SavedSlot& slot) const {
  Saved& out = value_in<Saved>(slot);
  out.values.clear();
  for (const Part& part : parts_) out.values.push_back(part.values);
  out.claimed = claimed_;
  out.pending = pending_;
  out.next = next_;
  out.reads = reads_;
  out.writes = writes_;
  return true;
}

void Loopback::restore(const SavedPart& saved) {
  const Saved* const before = value_of<Saved>(&saved);
  if (before == nullptr || before->values.size() != parts_.size()) return;
  for (std::size_t i = 0; i < parts_.size(); ++i) parts_[i].values = before->values[i];
  claimed_ = before->claimed;
  pending_ = before->pending;
  next_ = before->next;
  reads_ = before->reads;
  writes_ = before->writes;
}

bool Loopback::faulty(std::int64_t count) const {
  return count >= fault_at_ && (fault_for_ == 0 || count < fault_at_ + fault_for_);
}

HardwareReturn Loopback::failing(std::int64_t count) const {
  if (!faulty(count)) return HardwareReturn::ok;
  if (fault_ == Fault::thrown) throw std::runtime_error(fault());
  if (fault_ == Fault::error) return HardwareReturn::error;
  return fault_ == Fault::deactivate ? HardwareReturn::deactivate : HardwareReturn::ok;
}

std::string Loopback::fault() const {
  return fmt::format("its <param> 'fault' triggers it from {} {} on", fault_in_write_ ? "write" : "read",
                     fault_at_);
}

// A joint without commands keeps its position.
void Loopback::follow(Part& part, std::span<const double> commands, double dt) {
  const auto command = [&](std::size_t kind) {
    const std::size_t i = part.commands[kind];
    return i == kNone || !claimed_[i] ? kNaN : commands[i];
  };
  const double before = part.values[kPositionIndex];
  const double position = command(kPositionIndex), velocity = command(kVelocityIndex);
  // A position command is reached within the period, and the velocity is that of this jump; a velocity
  // command is integrated.
  if (std::isfinite(position)) {
    part.values[kPositionIndex] = position;
    part.values[kVelocityIndex] = (position - before) / dt;
  } else {
    part.values[kVelocityIndex] = std::isfinite(velocity) ? velocity : 0.0;
    part.values[kPositionIndex] += part.values[kVelocityIndex] * dt;
  }
  for (const std::size_t kind : {std::size_t{2}, std::size_t{3}}) {
    const double value = command(kind);
    part.values[kind] = std::isfinite(value) ? value : 0.0;
  }
}

HardwareReturn Loopback::read(Time /*now*/, Duration /*period*/, std::span<double> states) {
  ++reads_;
  if (const HardwareReturn answer = fault_in_write_ ? HardwareReturn::ok : failing(reads_);
      answer != HardwareReturn::ok)
    return answer;
  const bool now_faulty = faulty(reads_);
  if (now_faulty && fault_ == Fault::silent) return HardwareReturn::ok;
  if (now_faulty && fault_ == Fault::late)
    std::this_thread::sleep_for(std::chrono::duration<double>(fault_size_));
  for (const Part& part : parts_) {
    for (std::size_t kind = 0; kind < kQuantities.size(); ++kind) {
      if (part.states[kind] != kNone) states[part.states[kind]] = part.values[kind];
    }
  }
  for (const auto& [state, command] : mirrors_) {
    if (std::isfinite(pending_[next_][command])) states[state] = pending_[next_][command];
  }
  if (now_faulty && fault_ == Fault::wrong) {
    for (double& state : states) state += fault_size_;
  }
  if (now_faulty && fault_ == Fault::nan) std::fill(states.begin(), states.end(), kNaN);
  return HardwareReturn::ok;
}

HardwareReturn Loopback::write(Time /*now*/, Duration period, std::span<const double> commands) {
  ++writes_;
  if (const HardwareReturn answer = fault_in_write_ ? failing(writes_) : HardwareReturn::ok;
      answer != HardwareReturn::ok)
    return answer;
  std::copy(commands.begin(), commands.end(), pending_[next_].begin());
  next_ = (next_ + 1) % pending_.size();  // the oldest commands, whose delay has passed
  for (Part& part : parts_) follow(part, pending_[next_], to_seconds(period));
  return HardwareReturn::ok;
}

}  // namespace doppel
