#pragma once
// The controller manager's services as the command line uses them.

#include <string>
#include <vector>

#include "app/verbs/shell.h"
#include "doppel/messages/controller_manager_msgs.h"

namespace doppel::app {

// Every controller manager that there is.
std::vector<std::string> find_managers(Client& twin);
// The controller manager that is meant: `asked`, or the only one that there is, in whatever namespace. Throws
// InputError where nobody said which of several.
std::string find_manager(Client& twin, const std::string& asked);
// The option that says which.
void declare_manager(CLI::App& verb, std::string& manager);

std::vector<controller_manager_msgs::msg::ControllerState> list_controllers(Client& twin,
                                                                            const std::string& manager);

}  // namespace doppel::app
