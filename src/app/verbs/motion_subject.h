#pragma once
// What the verbs that repeat motions (verify, compare-engines) make of a machine.

#include <chrono>

#include "doppel/twin/machine.h"
#include "doppel/verification/motion.h"

namespace doppel::app {

inline constexpr double kMaxDuration = 60.0;               // s, of a motion
inline constexpr std::chrono::seconds kProgressPeriod{2};  // between two lines of progress

// The machine's first robot, and what else stands in its world.
MotionSubject motion_subject(Machine& machine);

}  // namespace doppel::app
