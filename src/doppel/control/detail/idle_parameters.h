#pragma once
// Parameters of ros2_control's manager that mean nothing here, where one thread and one clock do everything:
// they are there with ros2_control's defaults, so that files and tools that know them find them.

#include "doppel/bus/parameter_file.h"

namespace doppel {

// Declares them, read-only. Whatever else in `written` is meant for ros2_control only is marked as used.
// Throws InputError where a value is of another type.
void declare_idle_parameters(Parameters& parameters, ParameterOverrides& written);

}  // namespace doppel
