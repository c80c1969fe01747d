#pragma once
// The <param>s of ros2_control's mock_components/GenericSystem, of which the simulated robot follows none:
// it has physics where the mock copies commands to states.

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"

namespace doppel {

// A note for each one that has no effect, and a warning for one that the mock does not have either.
void report_mock_parameters(const HardwareDescription& hardware, Diagnostics& diagnostics);

}  // namespace doppel
