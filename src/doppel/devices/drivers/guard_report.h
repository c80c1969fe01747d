#pragma once
// The acts of a joint's guard in words, for the log of every driver.

#include <string>

#include "doppel/base/core/log.h"
#include "doppel/devices/drivers/motion_guard.h"
#include "doppel/export.h"

namespace doppel {

// A warning for each of `events`, which are JointGuard::take_events(). Between ticks: it allocates.
DOPPEL_API void log_guard_events(unsigned events, const std::string& component, const std::string& joint,
                                 const Log& log);

}  // namespace doppel
