#pragma once
// The controllers of mobile bases (base_controller.h), each in a file of its name.

#include <memory>

#include "doppel/control/controllers/detail/steering_geometry.h"
#include "doppel/control/manager/controller.h"

namespace doppel {

std::unique_ptr<Controller> make_diff_drive_controller();
std::unique_ptr<Controller> make_mecanum_drive_controller();
std::unique_ptr<Controller> make_omni_wheel_drive_controller();
std::unique_ptr<Controller> make_steering_controller(SteeringKind kind);
std::unique_ptr<Controller> make_tricycle_controller();

}  // namespace doppel
