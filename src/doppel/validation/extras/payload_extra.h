#pragma once
// X6: the mass that the drives hold at rest, over the reach of each arm.

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

// The share of an effort limit that a load at rest may take.
inline constexpr double kPayloadShare = 0.8;

DOPPEL_API CheckResult check_payload(const CheckContext& context);

}  // namespace doppel
