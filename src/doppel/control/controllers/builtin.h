#pragma once
// The built-in controllers, by the names of ros2_controllers.

#include "doppel/control/manager/controller.h"
#include "doppel/export.h"

namespace doppel {

// A registry with all built-in controllers.
DOPPEL_API ControllerRegistry builtin_controllers();

}  // namespace doppel
