#pragma once
// When a sensor takes its samples: number n, from 0, at (n + 1) / rate of simulated time, on the nearest step, without
// drift.

#include <cmath>
#include <cstdint>

#include "doppel/base/core/time.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API SampleSchedule {
 public:
  SampleSchedule() = default;
  // rate: Hz; 0, or more than one a step: every step (limited() says the latter).
  SampleSchedule(double rate, Duration step)
      : step_(step.count()), steps_per_sample_(rate > 0 ? 1e9 / (rate * static_cast<double>(step_)) : 1) {
    limited_ = rate > 0 && steps_per_sample_ < 1 - 1e-9;
    if (steps_per_sample_ < 1) steps_per_sample_ = 1;
  }

  [[nodiscard]] bool limited() const { return limited_; }
  [[nodiscard]] double period() const { return steps_per_sample_ * static_cast<double>(step_) * 1e-9; }  // s
  // The time of sample n.
  [[nodiscard]] Time at(std::uint64_t n) const {
    return start_ + Duration{step_ * std::llround(static_cast<double>(n + 1) * steps_per_sample_)};
  }
  // Begins to count at `now`; sample 0 is one period later.
  void restart(Time now) {
    start_ = now;
    next_ = 0;
  }
  // The same samples, counted on, from `now` in a world with this step.
  [[nodiscard]] SampleSchedule continued(double rate, Duration step, Time now) const {
    SampleSchedule out(rate, step);
    out.next_ = next_;
    // Samples at a rate keep their times; those of every step have none that a longer or shorter step could
    // keep.
    const bool keeps_times = rate > 0 && !limited_ && !out.limited_;
    out.start_ =
        keeps_times || step.count() == step_
            ? start_
            : now - Duration{out.step_ * std::llround(static_cast<double>(next_) * out.steps_per_sample_)};
    return out;
  }
  // The number of the next sample.
  [[nodiscard]] std::uint64_t next() const { return next_; }
  [[nodiscard]] bool due(Time now) const { return now >= at(next_); }
  // Takes the sample that is due; returns its number. Samples whose time has passed are skipped.
  std::uint64_t take(Time now) {
    while (at(next_ + 1) <= now) ++next_;
    return next_++;
  }

 private:
  Time start_{};
  std::int64_t step_ = 1'000'000;  // ns
  double steps_per_sample_ = 1;
  std::uint64_t next_ = 0;
  bool limited_ = false;
};

}  // namespace doppel
