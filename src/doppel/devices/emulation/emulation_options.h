#pragma once
// Additions to emulated devices: faults, a hand at the arm, a trace of their bytes.

#include <cstdint>
#include <filesystem>
#include <optional>

#include "doppel/devices/servos/servo_model.h"

namespace doppel {

// The hand of a person at joints whose torque is off.
enum class HandMotion {
  none,   // they fall
  guide,  // holds them, and moves them as the controllers of the emulation command
  sweep,  // moves one after the other through its whole range, and back
};

struct EmulationOptions {
  std::filesystem::path faults;  // see fault_file.h; empty: none
  std::uint64_t seed = 1;        // of faults with a share
  HandMotion hand = HandMotion::none;
  // Every joint gets a servo of this protocol, as strong as its drive is, where the description names no
  // driver of servos.
  std::optional<ServoProtocol> servos;
  std::filesystem::path trace;  // a text file that gets all bytes of the bus; empty: none
};

}  // namespace doppel
