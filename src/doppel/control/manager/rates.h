#pragma once
// Rates that a loop of fixed steps can keep.

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "doppel/base/core/time.h"

namespace doppel {

// The number of steps of length `step` in a period of `rate` (Hz), at least 1.
inline int steps_per_period(double rate, Duration step) {
  return std::max(1, static_cast<int>(std::lround(1.0 / (rate * to_seconds(step)))));
}

// Hz.
inline double rate_of(Duration period) {
  return 1.0 / to_seconds(period);
}

// True if two rates (Hz) differ by more than rounding.
inline bool differs(double rate, double real) {
  return std::abs(rate - real) > 1e-6 * rate;
}

// The longest step from half of `step` to `step` of which every period of `rates` (Hz) is a multiple;
// nullopt: there is none.
inline std::optional<Duration> step_for_rates(std::span<const double> rates, Duration step) {
  if (rates.empty()) return step;
  // Every such step is a whole part of the shortest period.
  const double shortest = 1.0 / *std::max_element(rates.begin(), rates.end());
  const int parts = std::max(1, static_cast<int>(std::ceil(shortest / to_seconds(step) - 1e-9)));
  for (int n = parts; n <= 2 * parts; ++n) {
    const Duration candidate = from_seconds(shortest / n);
    const bool divides = std::all_of(rates.begin(), rates.end(), [&](double rate) {
      return !differs(rate, rate_of(candidate * steps_per_period(rate, candidate)));
    });
    if (divides) return candidate;
  }
  return std::nullopt;
}

}  // namespace doppel
