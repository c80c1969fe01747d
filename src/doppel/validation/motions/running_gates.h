#pragma once
// Gates of a running twin: G08 transforms, G09 hardware and controllers, G10 one command, G11 physics.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_transforms(const CheckContext& context);
DOPPEL_API CheckResult check_controllers(const CheckContext& context);
DOPPEL_API CheckResult check_start(const CheckContext& context);
DOPPEL_API CheckResult check_holding(const CheckContext& context);

}  // namespace doppel
