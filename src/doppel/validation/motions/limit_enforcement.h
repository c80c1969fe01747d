#pragma once
// T2: commands beyond a joint's limits, on every way on which a client commands it.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_limit_enforcement(const CheckContext& context);

}  // namespace doppel
