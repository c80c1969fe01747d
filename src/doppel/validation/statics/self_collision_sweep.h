#pragma once
// T3: where the robot touches itself, over its whole joint space, and which pairs nobody checks.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_self_collision(const CheckContext& context);

}  // namespace doppel
