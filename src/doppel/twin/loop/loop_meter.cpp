#include "doppel/twin/loop/loop_meter.h"

namespace doppel {

void LoopMeter::restart(WallTime now, std::uint64_t steps, const LoopPhases& phases) {
  begin_ = now;
  steps_ = steps;
  phases_ = phases;
  means_.known = false;
}

bool LoopMeter::update(WallTime now, std::uint64_t steps, const LoopPhases& phases, Duration step) {
  const auto elapsed = now - begin_;
  if (elapsed < kWindow || steps <= steps_) return false;
  const auto count = static_cast<double>(steps - steps_);
  const auto mean = [count](std::chrono::nanoseconds then, std::chrono::nanoseconds since) {
    return static_cast<double>((since - then).count()) * 1e-3 / count;
  };
  Averages averages;
  averages.known = true;
  averages.real_time_factor =
      count * static_cast<double>(step.count()) /
      static_cast<double>(std::chrono::duration_cast<std::chrono::nanoseconds>(elapsed).count());
  averages.control = mean(phases_.control, phases.control);
  averages.physics = mean(phases_.physics, phases.physics);
  averages.publish = mean(phases_.publish, phases.publish);
  averages.bus = mean(phases_.bus, phases.bus);
  averages.idle = mean(phases_.idle, phases.idle);
  restart(now, steps, phases);
  means_ = averages;
  return true;
}

}  // namespace doppel
