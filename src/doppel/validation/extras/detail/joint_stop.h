#pragma once
// One stop of a joint that moves, in a twin.

#include <optional>
#include <vector>

#include "doppel/export.h"
#include "doppel/validation/metrics/stopping.h"
#include "doppel/validation/motions/machine_run.h"

namespace doppel {

// IEC 60204-1, 9.2.2: 0: the drives have no power from the trigger on; 1: they brake, and have none once the
// joint rests; 2: they brake and hold.
enum class StopCategory { off, brake_then_off, brake_and_hold };

struct JointStop {
  StopFigures figures;
  double tool_way = 0;                 // m: largest distance of the link from its place at the trigger
  bool ends_at_limit = false;          // of the joint
  std::vector<double> time, position;  // s after the trigger; rad or m
};

// The joint passes its present position at `speed` (rad/s or m/s), all others rest, and the stop is
// triggered. Braking is that of the twin's emergency stop: every drive holds the position of the trigger
// with up to its whole effort. Afterwards the emergency stop is latched; restore() and reset_stop() end it.
// `link`: of the machine's model, for tool_way. nullopt: the physics has diverged.
[[nodiscard]] DOPPEL_API std::optional<JointStop> stop_joint(MachineRun& machine, int joint, int link,
                                                             double speed, StopCategory category);

}  // namespace doppel
