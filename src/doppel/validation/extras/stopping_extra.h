#pragma once
// X9: how far the arm still moves when it is stopped, in the three categories of IEC 60204-1.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_stopping(const CheckContext& context);

}  // namespace doppel
