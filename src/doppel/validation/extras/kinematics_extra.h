#pragma once
// X1: forward and inverse kinematics agree, the Jacobian is the derivative, and the engine has the same
// links in the same places.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_kinematics(const CheckContext& context);

}  // namespace doppel
