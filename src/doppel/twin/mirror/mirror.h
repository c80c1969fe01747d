#pragma once
// Publishes, for every robot in its namespace, at 20 Hz:
//
//   /doppel/hardware (doppel_msgs/msg/Devices) the components that are devices, real or emulated
//   /doppel/mirror (doppel_msgs/msg/Mirror)     real hardware beside the twin: each joint's error and its
//                                               alarm, which is also a warning of the log
//
// and serves what a person does with the devices (detail/device_services.h).

#include "doppel/export.h"

namespace doppel {

class TwinCore;

// Adds them to the parts of the twin.
DOPPEL_API void add_mirror(TwinCore& core);

}  // namespace doppel
