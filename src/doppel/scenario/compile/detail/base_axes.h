#pragma once
// The axes and sides of wheels against the controller of the base that the user's file declares for them. A controller
// of ros2_control takes a positive velocity as ahead and a positive angle as to the left, and reads no axis.

#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/bus/parameter_file.h"
#include "doppel/scenario/compile/detail/base_wheels.h"

namespace doppel {

// A warning (up.base_axis) for each wheel that such a controller would drive backwards, steer to the other side, or has
// on the wrong side; and one (up.base_rollers) for a mecanum controller whose wheels have no rollers.
void report_base_axes(const std::vector<BaseWheel>& wheels, const ParameterFile& controllers,
                      Diagnostics& diagnostics);

}  // namespace doppel
