#pragma once
// Parameters of ros2_control's manager without effect here, where one thread and one clock do everything.
// They are declared with ros2_control's defaults, because files and tools use them.

#include "doppel/ros/bus/parameter_file.h"

namespace doppel {

// Declares them, read-only. Other entries of `written` that are meant for ros2_control only are marked as
// used. Throws InputError if a value has another type.
void declare_idle_parameters(Parameters& parameters, ParameterOverrides& written);

}  // namespace doppel
