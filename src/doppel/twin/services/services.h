#pragma once
// Gazebo's services of a twin: time, states and loads (/gazebo), entities that come and go (/spawn_entity,
// /delete_entity), and those of gz-sim below /world/NAME.

#include "doppel/export.h"

namespace doppel {

class TwinCore;

// Adds them to the parts of the twin.
DOPPEL_API void add_services(TwinCore& core);

}  // namespace doppel
