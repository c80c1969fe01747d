#pragma once
// The controller manager's services as the command line uses them.

#include <string>
#include <vector>

#include "app/verbs/shell.h"
#include "doppel/messages/controller_manager_msgs.h"

namespace doppel::app {

std::vector<controller_manager_msgs::msg::ControllerState> list_controllers(
    Client& twin, const std::string& manager = "/controller_manager");

}  // namespace doppel::app
