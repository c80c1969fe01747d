#pragma once
// The controllers that doppel has built in, by the names of ros2_controllers.

#include "doppel/control/controller.h"

namespace doppel {

// A registry with all of them.
ControllerRegistry builtin_controllers();

}  // namespace doppel
