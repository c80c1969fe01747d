#pragma once
// Controllers of joints beside joint_trajectory_controller, each in a file of its name.

#include <memory>

#include "doppel/control/manager/controller.h"

namespace doppel {

enum class GripperKind { position, effort, parallel };

std::unique_ptr<Controller> make_forward_command_controller();
std::unique_ptr<Controller> make_multi_interface_forward_command_controller();
std::unique_ptr<Controller> make_joint_group_controller(const char* interface);
std::unique_ptr<Controller> make_scalar_command_controller();
std::unique_ptr<Controller> make_pid_controller();
std::unique_ptr<Controller> make_gripper_controller(GripperKind kind);

}  // namespace doppel
