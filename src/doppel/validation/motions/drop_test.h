#pragma once
// T6: the robot falls onto the ground without drives.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_drop(const CheckContext& context);

}  // namespace doppel
