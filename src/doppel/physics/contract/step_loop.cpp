#include "doppel/physics/contract/step_loop.h"

namespace doppel {

RunEnd run_steps(const Stepped& stepped, const StepLimits& limits, const std::function<void()>& observe) {
  for (std::uint64_t steps = 0;; ++steps) {
    if (stepped.diverged()) return RunEnd::diverged;
    if (steps > 0 && observe) observe();
    if (limits.until && limits.until()) return RunEnd::condition_met;
    if (limits.cancel != nullptr && limits.cancel->load(std::memory_order_relaxed)) return RunEnd::stopped;
    if (steps == limits.steps) return RunEnd::duration_reached;
    stepped.step();
  }
}

RunEnd run_steps(Engine& engine, const StepLimits& limits, const std::function<void()>& observe) {
  return run_steps({[&engine] { engine.step(); }, [&engine] { return engine.diverged(); }}, limits, observe);
}

}  // namespace doppel
