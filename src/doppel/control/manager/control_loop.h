#pragma once
// The control loop of real hardware: a separate thread that ticks the controller manager at its period by the
// monotonic clock, with real-time priority and locked memory where the system permits it. Everything else of
// the manager (life cycle, YAML, parameters, spawning, the bus) stays on the other thread, which takes the
// gate for one piece of work at a time. A watchdog thread calls stall_hardware() if the loop is blocked.
//
// A simulation does not use it: it ticks the manager between its steps.

#include <pthread.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "doppel/base/core/log.h"
#include "doppel/control/manager/controller_manager.h"
#include "doppel/export.h"

namespace doppel {

// A recursive mutex for everything that the loop uses, with priority inheritance, so that the loop waits at
// most for one piece of work. Any thread.
class DOPPEL_API LoopGate {
 public:
  LoopGate();
  ~LoopGate();
  LoopGate(const LoopGate&) = delete;
  LoopGate& operator=(const LoopGate&) = delete;

  void lock();
  void unlock();
  // false: it was not available within this time, by the monotonic clock.
  bool try_lock_for(Duration at_most);

 private:
  pthread_mutex_t mutex_{};
};

struct ControlLoopOptions {
  int priority = 50;        // SCHED_FIFO; 0: the scheduler's usual one
  bool lock_memory = true;  // mlockall
  Duration stall{};         // time without a tick after which the loop is blocked; 0: 10 periods, >= 100 ms
};

class DOPPEL_API ControlLoop {
 public:
  // The manager, the gate and the log outlive the loop. `begin`: the manager's time now. Priority or
  // locking that the system does not permit is a note in the log. Throws std::system_error if no thread
  // can be started.
  ControlLoop(ControllerManager& manager, LoopGate& gate, Time begin, const ControlLoopOptions& options,
              const Log& log);
  ~ControlLoop();  // joins the threads; the caller may hold the gate
  ControlLoop(const ControlLoop&) = delete;
  ControlLoop& operator=(const ControlLoop&) = delete;

  // Called regularly by the other thread, with the gate: handles failures and stalls, logs overruns at most
  // once a second, passes the statistics to the manager. An exception in the loop is an emergency stop.
  // Stalls and overruns count from the first call on: until then the other thread starts the program, and
  // holds the gate for as long as that takes. Stalls count while hardware is active.
  void attend();
  // These require the gate.
  [[nodiscard]] Time now() const { return now_; }  // of the next tick
  [[nodiscard]] const LoopStatistics& statistics() const { return statistics_; }

 private:
  using Clock = std::chrono::steady_clock;
  void run();
  void count(Clock::time_point begun, Clock::time_point ended);
  void watch();
  void finish();  // joins the threads that have been started
  void prepare_thread(const ControlLoopOptions& options);

  ControllerManager& manager_;
  LoopGate& gate_;
  const Log& log_;
  const Duration period_, stall_;
  Time now_;
  std::atomic<bool> ends_{false};
  std::atomic<std::int64_t> last_tick_;         // ns of Clock
  std::atomic<std::int64_t> stood_still_{0};    // ns, of a stall that attend() has not handled; 0: none
  std::atomic<std::int64_t> watched_since_{0};  // ns of Clock; 0: not yet

  // Under the gate.
  LoopStatistics statistics_;
  struct Sums {
    std::uint64_t ticks = 0;
    double rate = 0, squares = 0, execution = 0;
  } sums_;  // of the second that began at second_
  Clock::time_point second_, last_begun_;
  std::uint64_t overruns_logged_ = 0;
  Clock::time_point next_log_;

  std::string thrown_;  // under watch_mutex_: what a thread of the loop has thrown; empty: nothing
  std::mutex watch_mutex_;
  std::condition_variable watch_ends_;
  std::thread loop_, watchdog_;
};

}  // namespace doppel
