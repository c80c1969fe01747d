#pragma once
// What the controller manager's services, its activity topic and its diagnostics say, as messages.

#include <optional>
#include <string>

#include "doppel/control/controller_manager.h"
#include "doppel/messages/controller_manager_msgs.h"
#include "doppel/messages/lifecycle_msgs.h"

namespace doppel {

lifecycle_msgs::msg::State lifecycle(ControllerState state);
lifecycle_msgs::msg::State lifecycle(HardwareState state);
// Either the number or the label says which state is meant; the label wins where both do, as in ros2_control.
std::optional<HardwareState> wanted_state(const lifecycle_msgs::msg::State& state);
std::uint16_t whole_hertz(double rate);
// ros2_control calls what inactive hardware offers available too, though nobody can be activated on it.
bool is_listed_available(HardwareState state);
controller_manager_msgs::msg::HardwareInterface interface_message(const std::string& name, bool available,
                                                                  bool claimed);

}  // namespace doppel
