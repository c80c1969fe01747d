#include "doppel/control/controllers/detail/jtc_interfaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/nan.h"

namespace doppel::jtc {
namespace {

constexpr const char* kNames[kKinds] = {kPosition, kVelocity, kAcceleration, kEffort};

template <class Handle>
const Handle* find(const std::vector<Handle>& handles, const std::string& full_name) {
  const auto found = std::find_if(handles.begin(), handles.end(),
                                  [&](const Handle& h) { return h.full_name() == full_name; });
  return found == handles.end() ? nullptr : &*found;
}

template <class Handle>
Status sort(const std::vector<std::string>& joints, const char* name, const char* direction,
            const std::vector<Handle>& handles, std::vector<Handle>& sorted) {
  for (const std::string& joint : joints) {
    if (const Handle* handle = find(handles, joint + "/" + name)) sorted.push_back(*handle);
  }
  if (sorted.size() == joints.size()) return {};
  return Status::refused(
      fmt::format("Expected {} '{}' {} interfaces, got {}.", joints.size(), name, direction, sorted.size()));
}

std::vector<double>& field(JointStates& states, std::size_t kind) {
  std::vector<double>* const fields[kKinds] = {&states.positions, &states.velocities, &states.accelerations,
                                               &states.effort};
  return *fields[kind];
}

}  // namespace

Status Interfaces::bind(const Settings& settings, const std::vector<std::size_t>& joint_of_command,
                        const std::vector<CommandHandle>& commands, const std::vector<StateHandle>& states) {
  release();
  joint_of_command_ = joint_of_command;
  command_of_joint_.assign(settings.joints.size(), -1);
  for (std::size_t i = 0; i < joint_of_command.size(); ++i) {
    command_of_joint_[joint_of_command[i]] = static_cast<int>(i);
  }
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    if (settings.commanded[kind]) {
      if (Status s = sort(settings.command_joints, kNames[kind], "command", commands, commands_[kind]); !s)
        return s;
    }
    if (settings.measured[kind]) {
      if (Status s = sort(settings.joints, kNames[kind], "state", states, states_[kind]); !s) return s;
    }
  }
  if (!settings.scaling_state.empty()) {
    const StateHandle* handle = find(states, settings.scaling_state);
    if (handle == nullptr) {
      return Status::refused(
          fmt::format("there is no state interface '{}' to read the speed scaling from; correct "
                      "speed_scaling.state_interface",
                      settings.scaling_state));
    }
    scaling_state = *handle;
  }
  if (!settings.scaling_command.empty()) {
    const CommandHandle* handle = find(commands, settings.scaling_command);
    if (handle == nullptr) {
      return Status::refused(
          fmt::format("there is no command interface '{}' to write the speed scaling to; correct "
                      "speed_scaling.command_interface",
                      settings.scaling_command));
    }
    scaling_command = *handle;
  }
  return {};
}

void Interfaces::release() {
  for (auto& handles : commands_) handles.clear();
  for (auto& handles : states_) handles.clear();
  scaling_state.reset();
  scaling_command.reset();
}

void Interfaces::read(JointStates& states) const {
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    std::vector<double>& values = field(states, kind);
    for (std::size_t j = 0; j < states_[kind].size(); ++j) values[j] = states_[kind][j].get();
  }
  states.has_velocities = !states_[index(Kind::velocity)].empty();
  states.has_accelerations = !states_[index(Kind::acceleration)].empty();
  for (std::size_t j = 0; j < states.effort.size(); ++j) states.effort[j] = command(Kind::effort, j);
}

void Interfaces::read_commands(JointStates& states) const {
  for (const Kind kind : {Kind::position, Kind::velocity, Kind::acceleration, Kind::effort}) {
    if (!all_commanded(kind)) continue;
    for (std::size_t i = 0; i < joint_of_command_.size(); ++i) {
      field(states, index(kind))[joint_of_command_[i]] = commands_[index(kind)][i].get();
    }
    states.has_velocities |= kind == Kind::velocity;
    states.has_accelerations |= kind == Kind::acceleration;
  }
}

bool Interfaces::all_commanded(Kind kind) const {
  const auto& handles = commands_[index(kind)];
  return !handles.empty() && std::all_of(handles.begin(), handles.end(), [](const CommandHandle& handle) {
    return std::isfinite(handle.get());
  });
}

double Interfaces::command(Kind kind, std::size_t joint) const {
  const int i = command_of_joint_[joint];
  const auto& handles = commands_[index(kind)];
  if (i < 0 || handles.empty()) return kNaN;
  return handles[static_cast<std::size_t>(i)].get();
}

void Interfaces::write(Kind kind, std::span<const double> of_joints) {
  auto& handles = commands_[index(kind)];
  for (std::size_t i = 0; i < handles.size(); ++i) {
    const double value = of_joints[joint_of_command_[i]];
    if (std::isfinite(value)) handles[i].set(value);
  }
}

}  // namespace doppel::jtc
