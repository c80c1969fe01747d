#pragma once
// Which joints a controller can bring to positions, and why a joint cannot be moved.

#include <string>
#include <vector>

#include "app/verbs/controllers.h"
#include "app/verbs/robot_watch.h"

namespace doppel::app {

// True if the controller, once it is active, brings the joint to positions.
bool moves(const controller_manager_msgs::msg::ControllerState& controller, const std::string& joint);

// Throws ClientError with the nearest name if `only` is not the name of a controller that moves joints; "" is
// none.
void check_controller(const std::vector<controller_manager_msgs::msg::ControllerState>& controllers,
                      const std::string& only);

// Throws what is wrong with the joint, for which there is no active controller that brings it to `position`.
[[noreturn]] void refuse_joint(Client& twin, const RobotWatch& robot, const std::string& manager,
                               const std::vector<controller_manager_msgs::msg::ControllerState>& controllers,
                               const std::string& joint, double position, const std::string& only);

}  // namespace doppel::app
