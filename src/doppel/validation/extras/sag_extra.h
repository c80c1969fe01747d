#pragma once
// X7: how far gravity moves the tool against the stiffness of the drives.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_sag(const CheckContext& context);

}  // namespace doppel
