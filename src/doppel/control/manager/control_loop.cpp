#include "doppel/control/manager/control_loop.h"

#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <utility>

#include "doppel/base/core/guarded_thread.h"
#include "doppel/control/manager/rates.h"

namespace doppel {
namespace {

constexpr const char* kOrigin = "control_loop";
constexpr Duration kGateTimeout = std::chrono::milliseconds(5);  // between checks whether the loop ends
constexpr Duration kMinStall = std::chrono::milliseconds(100);
constexpr int kStallPeriods = 10;
constexpr Duration kSecond = std::chrono::seconds(1);
constexpr Duration kGatePolling = std::chrono::microseconds(100);

timespec monotonic_time(std::chrono::steady_clock::time_point time) {
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
  return {ns / kSecond.count(), ns % kSecond.count()};
}

void sleep_until(std::chrono::steady_clock::time_point due) {
  const timespec when = monotonic_time(due);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) == EINTR) {
  }
}

}  // namespace

LoopGate::LoopGate() {
  pthread_mutexattr_t attributes;
  pthread_mutexattr_init(&attributes);
  pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  pthread_mutexattr_settype(&attributes, PTHREAD_MUTEX_RECURSIVE);
  pthread_mutex_init(&mutex_, &attributes);
  pthread_mutexattr_destroy(&attributes);
}

LoopGate::~LoopGate() {
  pthread_mutex_destroy(&mutex_);
}

void LoopGate::lock() {
  pthread_mutex_lock(&mutex_);
}

void LoopGate::unlock() {
  pthread_mutex_unlock(&mutex_);
}

bool LoopGate::try_lock_for(Duration at_most) {
  const auto due = std::chrono::steady_clock::now() + at_most;
#ifdef __SANITIZE_THREAD__  // of GCC 12, which does not see what pthread_mutex_clocklock locks
  int error = pthread_mutex_trylock(&mutex_);
#else
  const timespec until = monotonic_time(due);
  int error = pthread_mutex_clocklock(&mutex_, CLOCK_MONOTONIC, &until);
#endif
  // Linux before 5.14 waits for a mutex with priority inheritance by the wall clock only, which can be set.
  while (error != 0 && error != ETIMEDOUT && std::chrono::steady_clock::now() < due) {
    sleep_until(std::chrono::steady_clock::now() + kGatePolling);
    error = pthread_mutex_trylock(&mutex_);
  }
  return error == 0;
}

ControlLoop::ControlLoop(ControllerManager& manager, LoopGate& gate, Time begin,
                         const ControlLoopOptions& options, const Log& log)
    : manager_(manager),
      gate_(gate),
      log_(log),
      period_(manager.period()),
      stall_(options.stall > Duration{} ? options.stall : std::max(kMinStall, kStallPeriods * period_)),
      now_(begin),
      last_tick_(Clock::now().time_since_epoch().count()),
      second_(Clock::now()),
      last_begun_(second_),
      next_log_(second_) {
  const auto report = [this](const std::string& why) {
    const std::lock_guard lock(watch_mutex_);
    thrown_ = why;
  };
  try {
    watchdog_ = guarded_thread([this] { watch(); }, report);
    loop_ = guarded_thread([this] { run(); }, report);
    prepare_thread(options);
  } catch (...) {
    finish();
    throw;
  }
}

ControlLoop::~ControlLoop() {
  finish();
}

void ControlLoop::finish() {
  {
    const std::lock_guard lock(watch_mutex_);
    ends_ = true;
  }
  watch_ends_.notify_all();
  if (loop_.joinable()) loop_.join();
  if (watchdog_.joinable()) watchdog_.join();
}

void ControlLoop::prepare_thread(const ControlLoopOptions& options) {
  if (options.lock_memory && mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    log_.note(kOrigin, fmt::format("memory is not locked ({}): swapped-out pages can delay a cycle; raise "
                                   "'memlock' in /etc/security/limits.conf",
                                   std::strerror(errno)));
  }
  if (options.priority <= 0) return;
  const sched_param parameters{.sched_priority = options.priority};
  if (const int error = pthread_setschedparam(loop_.native_handle(), SCHED_FIFO, &parameters); error != 0) {
    log_.note(kOrigin, fmt::format("the loop runs without real-time priority ({}): other processes can delay "
                                   "a cycle; raise 'rtprio' in /etc/security/limits.conf to {}",
                                   std::strerror(error), options.priority));
  }
}

void ControlLoop::run() {
  Clock::time_point due = Clock::now();
  while (!ends_) {
    sleep_until(due);
    while (!gate_.try_lock_for(kGateTimeout)) {
      if (ends_) return;
    }
    const std::unique_lock held(gate_, std::adopt_lock);
    const auto begun = Clock::now();
    manager_.tick(now_);
    const auto ended = Clock::now();
    count(begun, ended);
    last_tick_.store(ended.time_since_epoch().count(), std::memory_order_relaxed);
    // Ticks that are already due are skipped, so that hardware is not read and written twice in a row
    // to catch up.
    const auto late = std::max(Duration{}, Duration(ended - due));
    statistics_.lateness.add(late);
    const auto missed = late.count() / period_.count();
    if (missed > 0) ++statistics_.overruns;
    due += (missed + 1) * period_;
    now_ += (missed + 1) * period_;
  }
}

void ControlLoop::count(Clock::time_point begun, Clock::time_point ended) {
  const double execution = to_seconds(ended - begun);
  const double rate = 1.0 / std::max(1e-9, to_seconds(begun - last_begun_));
  last_begun_ = begun;
  ++statistics_.ticks;
  statistics_.longest = std::max(statistics_.longest, execution);
  ++sums_.ticks;
  sums_.rate += rate;
  sums_.squares += rate * rate;
  sums_.execution += execution;
  if (begun - second_ < kSecond) return;
  const auto n = static_cast<double>(sums_.ticks);
  statistics_.rate = n / to_seconds(begun - second_);
  statistics_.rate_deviation = std::sqrt(std::max(0.0, sums_.squares / n - std::pow(sums_.rate / n, 2)));
  statistics_.execution = sums_.execution / n;
  sums_ = {};
  second_ = begun;
}

void ControlLoop::attend() {
  if (watched_since_ == 0) {
    watched_since_ = Clock::now().time_since_epoch().count();
    overruns_logged_ = statistics_.overruns;
  }
  manager_.settle(now_);
  std::string thrown;
  {
    const std::lock_guard lock(watch_mutex_);
    thrown = std::exchange(thrown_, {});
  }
  if (!thrown.empty()) manager_.stop("the control loop, which an exception has ended: " + thrown);
  if (const std::int64_t still = stood_still_.exchange(0); still != 0) {
    manager_.stop(fmt::format("watchdog: the control loop was blocked for {:.0f} ms",
                              static_cast<double>(still) * 1e-6));
  }
  manager_.report_loop(statistics_);
  const auto wall = Clock::now();
  if (statistics_.overruns == overruns_logged_ || wall < next_log_) return;
  log_.warning(
      kOrigin,
      fmt::format("Overrun detected! The controller manager missed its desired rate of {:g} Hz "
                  "{} time{}; the longest loop took {:.3f} ms",
                  rate_of(period_), statistics_.overruns - overruns_logged_,
                  statistics_.overruns - overruns_logged_ == 1 ? "" : "s", statistics_.longest * 1e3));
  overruns_logged_ = statistics_.overruns;
  next_log_ = wall + kSecond;
}

void ControlLoop::watch() {
  std::unique_lock lock(watch_mutex_);
  bool still = false;
  while (!watch_ends_.wait_for(lock, stall_ / 4, [this] { return ends_.load(); })) {
    const std::int64_t now = Clock::now().time_since_epoch().count();
    std::int64_t begun = watched_since_.load(std::memory_order_relaxed);
    if (begun == 0) continue;
    // Nothing moves before an activation, which may hold the gate for long: servos wake one after another.
    if (!manager_.has_active_hardware()) watched_since_.store(begun = now, std::memory_order_relaxed);
    const std::int64_t since = now - std::max(begun, last_tick_.load(std::memory_order_relaxed));
    if (since <= stall_.count()) {
      still = false;
    } else {
      if (!still) manager_.stall_hardware();
      still = true;
      stood_still_.store(since);
    }
  }
}

}  // namespace doppel
