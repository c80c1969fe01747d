#pragma once
// The controllers that doppel has built in, by the names of ros2_controllers.

#include "doppel/control/controller.h"
#include "doppel/export.h"

namespace doppel {

// A registry with all of them.
DOPPEL_API ControllerRegistry builtin_controllers();

}  // namespace doppel
