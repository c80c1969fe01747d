#pragma once
// X10: the effective mass and the speed of the tool, and the contact speed that the suite's limits allow.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_contact(const CheckContext& context);

}  // namespace doppel
