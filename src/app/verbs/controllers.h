#pragma once
// The controller manager's services as the command line uses them.

#include <string>
#include <vector>

#include "app/verbs/shell.h"
#include "doppel/ros/messages/controller_manager_msgs.h"

namespace doppel::app {

// All existing controller managers.
std::vector<std::string> find_managers(Client& twin);
// The selected controller manager: `asked`, or the only one, in any namespace. Throws InputError where there
// are several and none is selected.
std::string find_manager(Client& twin, const std::string& asked);
// The option that selects it.
void declare_manager(CLI::App& verb, std::string& manager);

std::vector<controller_manager_msgs::msg::ControllerState> list_controllers(Client& twin,
                                                                            const std::string& manager);
// True if the manager publishes that its emergency stop is on.
bool is_stopped(Client& twin, const std::string& manager);
// The command interfaces that an active controller claims, or an inactive one requires.
const std::vector<std::string>& command_interfaces_of(
    const controller_manager_msgs::msg::ControllerState& controller);
// The joints whose interfaces an active controller claims, or an inactive one requires, each once.
std::vector<std::string> joints_of(const controller_manager_msgs::msg::ControllerState& controller);

void add_controller_chains(CLI::App& group, int& exit_code);  // control view_controller_chains

}  // namespace doppel::app
