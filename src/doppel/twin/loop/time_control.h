#pragma once
// Pause and speed of simulated time. Written by services, read by the runner, both on the loop's thread.

#include <cstdint>
#include <string>

namespace doppel {

// The slowest and the fastest pace that can be asked for, simulated per wall second, besides "as fast as
// possible".
inline constexpr double kMinSpeed = 1e-3, kMaxSpeed = 1e3;

struct TimeControl {
  bool paused = false;
  std::uint64_t steps_owed = 0;  // steps to run although paused
  double speed = 1.0;            // simulated per wall second; 0: as fast as possible
  // A twin whose physics has diverged is paused, because it can take no step, and continues after a reset.
  // False: the caller of the loop handles it.
  bool pauses_at_divergence = false;
  std::string divergence;  // while it is diverged: when, what moved, what acted; empty: it is not
};

}  // namespace doppel
