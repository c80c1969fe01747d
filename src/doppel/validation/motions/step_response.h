#pragma once
// T4: a step of each joint through its real controller.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_step_response(const CheckContext& context);

}  // namespace doppel
