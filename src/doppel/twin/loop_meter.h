#pragma once
// Where the loop's wall time goes: means over windows of half a second. Nothing of it allocates.

#include <chrono>
#include <cstdint>

#include "doppel/core/time.h"
#include "doppel/export.h"

namespace doppel {

// Wall time since the start, by what was done in it.
struct LoopPhases {
  std::chrono::nanoseconds control{};  // hardware and controllers, with what they publish
  std::chrono::nanoseconds physics{};  // the engine's step
  std::chrono::nanoseconds publish{};  // /tf and /clock
  std::chrono::nanoseconds bus{};      // between steps: services, what came in, reports
  std::chrono::nanoseconds idle{};     // sleeping until the next step is due
};

class DOPPEL_API LoopMeter {
 public:
  using WallTime = std::chrono::steady_clock::time_point;

  struct Averages {
    bool known = false;           // they are of a whole window since restart()
    double real_time_factor = 0;  // simulated per wall second
    double control = 0, physics = 0, publish = 0, bus = 0, idle = 0;  // microseconds per step
  };

  // A window begins, after a pause or a change of speed; until it is over the means are those from before.
  void restart(WallTime now, std::uint64_t steps, const LoopPhases& phases);
  // After each step. True: a window was over, and means() are new.
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
