#pragma once
// The controllers that doppel has built in, by the names of ros2_controllers.

#include "doppel/control/controller.h"

namespace doppel {

void register_builtin_controllers(ControllerRegistry& registry);

}  // namespace doppel
