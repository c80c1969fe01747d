#pragma once
// Shared by the verbs that repeat motions (verify, compare-engines).

#include <chrono>

#include "doppel/lab/verification/motion.h"
#include "doppel/scenario/compile/compiled_scenario.h"

namespace doppel::app {

inline constexpr std::chrono::seconds kProgressPeriod{2};  // between two lines of progress

// --duration of a motion, s. Throws InputError cli.duration.
void check_duration(double seconds);

// The machine's first robot, and the other objects in its world.
MotionSubject motion_subject(CompiledScenario& machine);

}  // namespace doppel::app
