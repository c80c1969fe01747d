#pragma once
// The control loop of real hardware: a thread of its own that ticks the controller manager at its period by
// the monotonic clock, with real-time priority and locked memory where the system permits it. Everything else
// of the manager (life cycle, YAML, parameters, spawning, the bus) stays on the thread that holds the loop
// off while it works; it takes the gate for one piece of work at a time. A third thread watches: where the
// loop stands still, hardware is told to stop by itself.
//
// A simulation needs none of this: it ticks the manager between its steps.

#include <pthread.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "doppel/control/controller_manager.h"
#include "doppel/core/log.h"
#include "doppel/export.h"

namespace doppel {

// Who has it may touch what the loop uses. With priority inheritance, so that the loop waits no longer than
// one piece of work takes; the thread that has it may take it again.
class DOPPEL_API LoopGate {
 public:
  LoopGate();
  ~LoopGate();
  LoopGate(const LoopGate&) = delete;
  LoopGate& operator=(const LoopGate&) = delete;

  void lock();
  void unlock();
  // false: it could not be had for so long.
  bool try_lock_for(Duration at_most);

 private:
  pthread_mutex_t mutex_{};
};

struct ControlLoopOptions {
  int priority = 50;        // SCHED_FIFO; 0: the scheduler's usual one
  bool lock_memory = true;  // mlockall
  Duration stall{};         // without a tick: the loop stands still; zero: ten periods, at least 100 ms
};

class DOPPEL_API ControlLoop {
 public:
  // The manager and the gate outlive the loop. `begin`: the manager's time now. What the system does not
  // permit is a note in the log.
  ControlLoop(ControllerManager& manager, LoopGate& gate, Time begin, const ControlLoopOptions& options,
              const Log& log);
  ~ControlLoop();  // may be called by who has the gate
  ControlLoop(const ControlLoop&) = delete;
  ControlLoop& operator=(const ControlLoop&) = delete;

  // The other thread, with the gate, often: deals with what has failed or stood still, logs overruns once a
  // second, hands the statistics to the manager.
  void attend();
  // With the gate.
  [[nodiscard]] Time now() const { return now_; }  // of the next tick
  [[nodiscard]] const LoopStatistics& statistics() const { return statistics_; }

 private:
  using Clock = std::chrono::steady_clock;
  void run();
  void count(Clock::time_point begun, Clock::time_point ended);
  void watch();
  void prepare_thread(const ControlLoopOptions& options);

  ControllerManager& manager_;
  LoopGate& gate_;
  const Log& log_;
  const Duration period_, stall_;
  Time now_;
  std::atomic<bool> ends_{false};
  std::atomic<std::int64_t> last_tick_;       // ns of Clock
  std::atomic<std::int64_t> stood_still_{0};  // ns, of a stall that attend() has not dealt with; 0: none

  // Under the gate.
  LoopStatistics statistics_;
  struct Sums {
    std::uint64_t ticks = 0;
    double rate = 0, squares = 0, execution = 0;
  } sums_;  // of the second that began at second_
  Clock::time_point second_, last_begun_;
  std::uint64_t overruns_logged_ = 0;
  Clock::time_point next_log_;

  std::mutex watch_mutex_;
  std::condition_variable watch_ends_;
  std::thread loop_, watchdog_;
};

}  // namespace doppel
