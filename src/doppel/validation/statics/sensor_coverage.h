#pragma once
// T5: how much of the workspace, and of the tool's places, each sensor of light sees past the robot itself.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_sensor_coverage(const CheckContext& context);

}  // namespace doppel
