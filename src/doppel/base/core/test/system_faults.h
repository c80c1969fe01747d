#pragma once
// Faults of the system, for the program that doppel_system_faults is linked into: threads that cannot be
// started, a wall clock that is set while something waits, and a disk that is slow or fails.

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

// While it lives, each fsync() waits for release(), which its end calls, too. One at a time.
class SlowDisk {
 public:
  SlowDisk();
  ~SlowDisk();
  SlowDisk(const SlowDisk&) = delete;
  SlowDisk& operator=(const SlowDisk&) = delete;

  static void wait_for_sync();  // until one waits
  static void release();
  // Counts those that waited and then failed, as where their file was closed meanwhile.
  [[nodiscard]] static int failed_syncs();
};

// While it lives, each fsync() fails with this errno.
class FailingDisk {
 public:
  explicit FailingDisk(int error);
  ~FailingDisk();
  FailingDisk(const FailingDisk&) = delete;
  FailingDisk& operator=(const FailingDisk&) = delete;
};

}  // namespace doppel
