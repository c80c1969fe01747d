#pragma once
// Rates that a loop of fixed steps can keep.

#include <algorithm>
#include <cmath>

#include "doppel/core/time.h"

namespace doppel {

// The number of steps of length `step` in a period of `rate` (Hz), at least 1.
inline int steps_per_period(double rate, Duration step) {
  return std::max(1, static_cast<int>(std::lround(1.0 / (rate * to_seconds(step)))));
}

// Hz.
inline double rate_of(Duration period) {
  return 1.0 / to_seconds(period);
}

// Whether two rates (Hz) differ by more than rounding.
inline bool differs(double rate, double real) {
  return std::abs(rate - real) > 1e-6 * rate;
}

}  // namespace doppel
