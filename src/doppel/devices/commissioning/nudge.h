#pragma once
// Moves one joint by a few degrees with little torque, and measures which joints moved: whether it is the
// right one, and a person sees in which direction. All other servos keep the torque that they have.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/export.h"

namespace doppel {

struct NudgeOptions {
  double angle = 3 * 0.0174532925;  // rad, of the joint
  double torque = 0.3;              // of the stall torque
  double seconds = 1.0;             // there, and as long back
  std::function<bool()> ends = {};  // true: the motion ends where it is. May be empty.
};

struct DOPPEL_API NudgeResult {
  double way = 0;        // rad, commanded: towards the middle of its range
  double moved = 0;      // rad, of the joint, at the far end; positive: along the way
  double returned = 0;   // rad, from where it began, at the end
  double peak_load = 0;  // share of the stall torque
  struct Other {
    std::string joint;
    double moved = 0;
  };
  std::vector<Other> others;  // that moved as well: they carry each other's plugs, or share an id
  bool ended = false;         // by a person
  [[nodiscard]] bool followed(double angle) const;  // within a third
};

// The joint moves towards the middle of its range. Throws InputError: no such joint; a servo of the setup
// does not answer, so that it is not known whether it moved as well; outside of the limits.
[[nodiscard]] DOPPEL_API NudgeResult nudge(ServoBus& bus, const ServoSetup& setup, const std::string& joint,
                                           const NudgeOptions& options);

}  // namespace doppel
