#pragma once
// What the verbs that repeat motions (verify, compare-engines) make of a machine.

#include "doppel/twin/machine.h"
#include "doppel/verification/motion.h"

namespace doppel::app {

// The machine's first robot, and what else stands in its world.
MotionSubject motion_subject(Machine& machine);

}  // namespace doppel::app
