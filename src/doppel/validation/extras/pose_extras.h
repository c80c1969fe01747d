#pragma once
// Extras that move an arm through the test poses of ISO 9283: X3 pose accuracy and repeatability, X4
// distance, stabilisation, overshoot and time, X8 power.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_pose_accuracy(const CheckContext& context);
DOPPEL_API CheckResult check_pose_approach(const CheckContext& context);
DOPPEL_API CheckResult check_power(const CheckContext& context);

}  // namespace doppel
