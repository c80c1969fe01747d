#pragma once
// X2: the frequency response of each joint through its controller, beside that of the servo model.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_frequency_response(const CheckContext& context);

}  // namespace doppel
