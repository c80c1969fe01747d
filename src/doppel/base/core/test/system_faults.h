#pragma once
// Faults of the system, for the program that doppel_system_faults is linked into: threads that cannot be
// started, and a wall clock that is set while something waits.

#include <ctime>

namespace doppel {

// While it lives, the first `allowed` threads start and every later one fails as without resources.
class ThreadShortage {
 public:
  explicit ThreadShortage(int allowed);
  ~ThreadShortage();
  ThreadShortage(const ThreadShortage&) = delete;
  ThreadShortage& operator=(const ThreadShortage&) = delete;
};

// While it lives, programs read a wall clock that is `seconds` ahead of the system's, as if the system's had
// been set back after they have read it. The monotonic clock is not affected.
class WallClockAhead {
 public:
  explicit WallClockAhead(std::time_t seconds);
  ~WallClockAhead();
  WallClockAhead(const WallClockAhead&) = delete;
  WallClockAhead& operator=(const WallClockAhead&) = delete;
};

}  // namespace doppel
