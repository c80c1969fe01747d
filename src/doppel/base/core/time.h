#pragma once
// Simulated time: nanoseconds since the start of the run, exact, so that a million steps of 1 ms are 1000 s.

#include <chrono>
#include <cstdint>

namespace doppel {

using Duration = std::chrono::nanoseconds;
using Time = std::chrono::nanoseconds;  // since the start of the simulation

constexpr double to_seconds(Duration d) {
  return static_cast<double>(d.count()) * 1e-9;
}

// Rounds to the nearest nanosecond. Precondition: |seconds| < 9e9.
constexpr Duration from_seconds(double seconds) {
  return Duration(static_cast<std::int64_t>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5)));
}

}  // namespace doppel
