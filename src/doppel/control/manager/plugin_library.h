#pragma once
// Shared libraries of the user (`--plugin`) with controllers, hardware components, or both.

#include <string>

#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/control/manager/controller.h"
#include "doppel/export.h"

namespace doppel {

// dlopen()s a library made with DOPPEL_EXPORT_CONTROLLER or DOPPEL_EXPORT_HARDWARE and registers what it
// exports. Throws InputError: it cannot be loaded, it exports nothing, or a name is already registered.
DOPPEL_API void load_plugin_library(const std::string& path, ControllerRegistry& controllers,
                                    HardwareRegistry& hardware);

}  // namespace doppel
