#pragma once
// Gates about shapes and motion of the description: G05 collision shapes, G07 loads, draws, moves.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

DOPPEL_API CheckResult check_collision_shapes(const CheckContext& context);
DOPPEL_API CheckResult check_motion_ranges(const CheckContext& context);

}  // namespace doppel
