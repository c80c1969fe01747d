#pragma once
// Drives a joint that stands outside of its limits back inside, slowly and with little torque.

#include <functional>
#include <string>

#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/export.h"

namespace doppel {

struct RecoveryOptions {
  double speed = 5 * 0.0174532925;  // rad/s, of the joint
  double torque = 0.3;              // of the stall torque
  std::function<bool()> ends = {};  // true: the motion ends where it is. May be empty.
};

struct Recovery {
  double start = 0, goal = 0, end = 0;  // rad
  bool ended = false;                   // by a person
  bool is_inside = false;               // the joint is inside of its limits
};

// The way of a joint: where it has to go, rad, and where it is; equal: it is inside. Nothing moves. Throws
// InputError: no such joint, no answer.
[[nodiscard]] DOPPEL_API Recovery plan_recovery(ServoBus& bus, const ServoSetup& setup,
                                                const std::string& joint);
// The joint holds where it ends, with this torque: without it, its load could take it outside again.
[[nodiscard]] DOPPEL_API Recovery recover(ServoBus& bus, const ServoSetup& setup, const std::string& joint,
                                          const RecoveryOptions& options);

}  // namespace doppel
