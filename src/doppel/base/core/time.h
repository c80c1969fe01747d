#pragma once
// Time of a run and durations, in nanoseconds, exact, so that a million steps of 1 ms are 1000 s. A point in
// time and a duration are different types (std::chrono): their difference is a duration, and two times cannot
// be added.

#include <chrono>
#include <cstdint>

namespace doppel {

using Duration = std::chrono::nanoseconds;

// The clock of a run. It counts from the start of the simulation, and stands still while the run is paused.
// It has no now(): the time of a run is a property of its engine or its bus, so that two runs in a process
// are independent.
struct RunClock {
  using rep = Duration::rep;
  using period = Duration::period;
  using duration = Duration;
  using time_point = std::chrono::time_point<RunClock>;
  static constexpr bool is_steady = false;  // a reset sets it back
};
using Time = RunClock::time_point;

constexpr Time time_from_nanoseconds(std::int64_t nanoseconds) {
  return Time(Duration(nanoseconds));
}
constexpr std::int64_t nanoseconds_of(Time time) {
  return time.time_since_epoch().count();
}

constexpr double to_seconds(Duration d) {
  return static_cast<double>(d.count()) * 1e-9;
}
constexpr double to_seconds(Time time) {
  return to_seconds(time.time_since_epoch());
}

// Rounds to the nearest nanosecond. Precondition: |seconds| < 9e9.
constexpr Duration from_seconds(double seconds) {
  return Duration(static_cast<std::int64_t>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5)));
}
constexpr Time time_from_seconds(double seconds) {
  return Time(from_seconds(seconds));
}

// The time of the system's clock, for messages that are stamped with it: nanoseconds since 1970 (UTC).
inline Time system_time() {
  return Time(std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()));
}

}  // namespace doppel
