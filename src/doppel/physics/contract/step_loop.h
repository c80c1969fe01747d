#pragma once
// The loop of every run without a pace of its own: of an engine here, of a twin in lab/headless_run. A
// divergence is an end of a run like any other, never an exception.

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>

#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

enum class RunEnd {
  duration_reached,
  condition_met,
  diverged,  // the state is the last finite one
  failed,    // an exception ended it
  stopped,   // from another thread
};
inline constexpr const char* kRunEndNames[] = {"duration_reached", "condition_met", "diverged", "failed",
                                               "stopped"};
inline const char* name_of(RunEnd end) {
  return kRunEndNames[static_cast<int>(end)];
}

struct StepLimits {
  std::uint64_t steps = std::numeric_limits<std::uint64_t>::max();
  std::function<bool()> until = {};  // asked before each step and after the last one; true: the run ends
  const std::atomic<bool>* cancel = nullptr;  // true: the run ends
};

// The steps of a loop, and the test of whether the physics has diverged.
struct Stepped {
  std::function<void()> step;
  std::function<bool()> diverged;
};

// Steps until a limit is reached or the physics diverges; `observe` is called after each step with a finite
// result. Passes on what these functions throw.
DOPPEL_API RunEnd run_steps(const Stepped& stepped, const StepLimits& limits,
                            const std::function<void()>& observe = {});
DOPPEL_API RunEnd run_steps(Engine& engine, const StepLimits& limits,
                            const std::function<void()>& observe = {});

// The least number of steps that take `duration` or longer.
constexpr std::uint64_t steps_in(Duration duration, Duration step) {
  return duration.count() <= 0
             ? 0
             : static_cast<std::uint64_t>((duration.count() + step.count() - 1) / step.count());
}

}  // namespace doppel
