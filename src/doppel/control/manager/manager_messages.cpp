#include "doppel/control/manager/detail/manager_messages.h"

#include <algorithm>
#include <cmath>

namespace doppel {

using LifecycleState = lifecycle_msgs::msg::State;

LifecycleState lifecycle(ControllerState state) {
  LifecycleState out;
  out.id = state == ControllerState::active     ? LifecycleState::PRIMARY_STATE_ACTIVE
           : state == ControllerState::inactive ? LifecycleState::PRIMARY_STATE_INACTIVE
                                                : LifecycleState::PRIMARY_STATE_UNCONFIGURED;
  out.label = to_string(state);
  return out;
}

LifecycleState lifecycle(HardwareState state) {
  LifecycleState out;
  out.label = to_string(state);
  switch (state) {
    case HardwareState::unconfigured:
      out.id = LifecycleState::PRIMARY_STATE_UNCONFIGURED;
      break;
    case HardwareState::inactive:
      out.id = LifecycleState::PRIMARY_STATE_INACTIVE;
      break;
    case HardwareState::active:
      out.id = LifecycleState::PRIMARY_STATE_ACTIVE;
      break;
    case HardwareState::finalized:
      out.id = LifecycleState::PRIMARY_STATE_FINALIZED;
      break;
  }
  return out;
}

std::optional<HardwareState> wanted_state(const LifecycleState& state) {
  for (const HardwareState candidate : {HardwareState::unconfigured, HardwareState::inactive,
                                        HardwareState::active, HardwareState::finalized}) {
    const LifecycleState as_message = lifecycle(candidate);
    if (state.label.empty() ? state.id == as_message.id : state.label == as_message.label) return candidate;
  }
  return std::nullopt;
}

std::uint16_t whole_hertz(double rate) {
  return static_cast<std::uint16_t>(std::lround(std::min(rate, 65535.0)));
}

bool is_listed_available(HardwareState state) {
  return state == HardwareState::inactive || state == HardwareState::active;
}

controller_manager_msgs::msg::HardwareInterface interface_message(const std::string& name, bool available,
                                                                  bool claimed) {
  return {name, "double", available, claimed};
}

}  // namespace doppel
