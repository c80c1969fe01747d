#pragma once
// The path characteristics of ISO 9283 in a twin (docs/validate_extras.md).

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

// X5: accuracy and repeatability of a line, a circle and a corner in the test plane, at 10, 50 and 100 % of
// the speed that the joints' limits permit.
DOPPEL_API CheckResult check_paths(const CheckContext& context);

}  // namespace doppel
