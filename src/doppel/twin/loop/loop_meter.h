#pragma once
// The loop's use of wall-clock time: means over windows of half a second. Does not allocate.

#include <chrono>
#include <cstdint>

#include "doppel/base/core/time.h"
#include "doppel/export.h"

namespace doppel {

// Wall-clock time since the start, by activity.
struct LoopPhases {
  std::chrono::nanoseconds control{};  // hardware and controllers, including their publishing
  std::chrono::nanoseconds physics{};  // the engine's step
  std::chrono::nanoseconds publish{};  // /tf and /clock
  std::chrono::nanoseconds bus{};      // between steps: services, received messages, reports
  std::chrono::nanoseconds idle{};     // sleeping until the next step is due
};

class DOPPEL_API LoopMeter {
 public:
  using WallTime = std::chrono::steady_clock::time_point;

  struct Averages {
    bool known = false;           // a whole window has passed since restart()
    double real_time_factor = 0;  // simulated per wall second
    double control = 0, physics = 0, publish = 0, bus = 0, idle = 0;  // microseconds per step
  };

  // Begins a window, after a pause or a change of speed; until it is over the former means remain.
  void restart(WallTime now, std::uint64_t steps, const LoopPhases& phases);
  // Called after each step. True: a window is over, and averages() has changed.
  bool update(WallTime now, std::uint64_t steps, const LoopPhases& phases, Duration step);
  [[nodiscard]] const Averages& averages() const { return means_; }

 private:
  static constexpr std::chrono::milliseconds kWindow{500};
  WallTime begin_;
  std::uint64_t steps_ = 0;
  LoopPhases phases_;
  Averages means_;
};

}  // namespace doppel
