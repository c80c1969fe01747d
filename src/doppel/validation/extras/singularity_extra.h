#pragma once
// X11: where an arm loses a direction of its tool, in its named poses and on straight lines between them.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

// The least ratio of the singular values of the scaled Jacobian (robot/ik/chain_jacobian.h).
inline constexpr double kSingularRatio = 0.02;

DOPPEL_API CheckResult check_singularities(const CheckContext& context);

}  // namespace doppel
