#pragma once
// The content of the controller manager's services, activity topic and diagnostics as messages.

#include <optional>
#include <string>

#include "doppel/control/manager/controller_manager.h"
#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/lifecycle_msgs.h"

namespace doppel {

lifecycle_msgs::msg::State lifecycle(ControllerState state);
lifecycle_msgs::msg::State lifecycle(HardwareState state);
// The state is given by its number or its label; the label has priority if both are given,
// as in ros2_control.
std::optional<HardwareState> wanted_state(const lifecycle_msgs::msg::State& state);
std::uint16_t whole_hertz(double rate);
// As in ros2_control, interfaces of inactive hardware are available too, although no controller can be
// activated on them.
bool is_listed_available(HardwareState state);
controller_manager_msgs::msg::HardwareInterface interface_message(const std::string& name, bool available,
                                                                  bool claimed);

}  // namespace doppel
