#pragma once
// Gates that the audit decides: G04 inertias, G06 limits; and what it says of controllers and hardware.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_inertias(const CheckContext& context);
DOPPEL_API CheckResult check_limits(const CheckContext& context);
// Adds the audit's findings about ros2_control and controllers to the gate G09.
DOPPEL_API void add_control_findings(const CheckContext& context, CheckResult& out);

}  // namespace doppel
