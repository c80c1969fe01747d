#pragma once
// The services of the arms of a twin's robots, in the namespace of each:
//
//   compute_ik, compute_fk, check_state_validity   moveit_msgs, of the node move_group
//   doppel/ik, doppel/reach, doppel/arms           doppel_msgs: with branches, reasons and maps
//
// The loop copies the state of the world and sends the answer; everything else runs on a thread with a
// lower priority, which starts with the first request.

#include "doppel/export.h"

namespace doppel {

class TwinCore;

// Adds them to the parts of the twin.
DOPPEL_API void add_arms(TwinCore& core);

}  // namespace doppel
