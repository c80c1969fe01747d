#pragma once
// Servos for a robot whose description names none, so that a bus can be emulated for any robot.

#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/export.h"

namespace doppel {

// The hardware is driven by servos of this protocol: each joint with a position command gets one, with ids
// from 1 on in the order of the description (a board: channels from 0 on), whose travel covers the joint's
// limits. Other command interfaces are removed, which servos do not have. Hardware that a driver of servos
// drives stays as it is. Returns whether it has servos now.
DOPPEL_API bool assign_servos(HardwareDescription& hardware, const Model& model, ServoProtocol protocol);

}  // namespace doppel
