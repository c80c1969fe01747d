#pragma once
// T1: poses that are reachable by construction are found again, and what is reachable of the workspace.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_reachability(const CheckContext& context);

}  // namespace doppel
