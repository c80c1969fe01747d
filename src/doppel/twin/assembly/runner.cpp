#include "doppel/twin/assembly/runner.h"

#include <fmt/format.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <condition_variable>
#include <ctime>
#include <mutex>
#include <thread>
#include <utility>

#include "doppel/base/core/guarded_thread.h"

namespace doppel {
namespace {

constexpr std::chrono::milliseconds kMaxScheduleLag{100};  // further behind than this, the schedule is moved
constexpr std::chrono::milliseconds kPausedPollInterval{2};
constexpr std::chrono::milliseconds kMaxSleep{20};  // with a slow pace, between two looks at requests
// The share of the loop's time for requests of edges: they get more while a step waits for its time anyway.
constexpr double kEdgeShareWithIdleTime = 0.1, kMinEdgeShare = 0.02;
constexpr std::uint64_t kStepsAtOnce = 100;  // while paused, between two calls of between_steps()

void sleep_until(std::chrono::steady_clock::time_point due) {
  const auto since = due.time_since_epoch();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(since);
  timespec at{};
  at.tv_sec = static_cast<time_t>(seconds.count());
  at.tv_nsec = static_cast<long>((since - seconds).count());
  // An absolute time, because an interrupted relative sleep would be started again with its whole length.
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
  }
}

}  // namespace

// A thread that notices that the loop makes no progress: a controller, a hardware component or a request
// blocks it, which nothing in the loop itself can report.
class Runner::StallWatch {
 public:
  explicit StallWatch(const Runner& runner) : runner_(runner) {
    if (runner.options_.report_stall) thread_ = guarded_thread([this] { run(); }, [](const std::string&) {});
  }
  ~StallWatch() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    wake_.notify_all();
    if (thread_.joinable()) thread_.join();
  }
  StallWatch(const StallWatch&) = delete;
  StallWatch& operator=(const StallWatch&) = delete;

 private:
  void run() {
    std::uint64_t seen = 0;
    bool stalled = false;
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, kLoopStall, [this] { return ends_; })) {
      // Relaxed order is sufficient: only a change of the counter matters, not what was written before it.
      const std::uint64_t now = runner_.progress_.load(std::memory_order_relaxed);
      const bool stands = now == seen;
      seen = now;
      if (stands == stalled) continue;
      stalled = stands;
      runner_.options_.report_stall(stands ? text() : "the loop goes on");
    }
  }

  [[nodiscard]] std::string text() const {
    const bool steps = runner_.activity_.load(std::memory_order_relaxed) == Activity::step;
    return fmt::format("the loop has been in one {} for {} s; time stands still meanwhile: {} blocks",
                       steps ? "step" : "request", std::chrono::duration<double>(kLoopStall).count(),
                       steps
                           ? "a controller, a hardware component or the physics"
                           : "a service, a message or the life cycle of a controller or hardware component");
  }

  const Runner& runner_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ends_ = false;
  std::thread thread_;
};

void Runner::handle_requests() {
  enter(Activity::requests);
  const std::uint64_t before = twin_.steps();
  twin_.between_steps();
  if (twin_.steps() != before) continue_from_other_step(before);
}

// A restored state has another number of steps: those that were taken so far count, and the schedule begins
// anew.
void Runner::continue_from_other_step(std::uint64_t before) {
  taken_ += before - counted_;
  simulated_ += static_cast<std::int64_t>(before - counted_) * step_size_;
  counted_ = twin_.steps();
  restart_schedule();
  meter_.restart(anchor_wall_, anchor_steps_, phases());
}

void Runner::take_step() {
  enter(Activity::step);
  twin_.step();
}

double RunStatistics::real_time_factor() const {
  return wall.count() > 0 ? static_cast<double>(simulated.count()) / static_cast<double>(wall.count()) : 0.0;
}

Runner::Runner(Twin& twin, RunnerOptions options)
    : twin_(twin), options_(std::move(options)), status_(twin.bus(), twin.name(), Clock::now()) {
  twin_.time_control().speed = options_.speed;
  twin_.time_control().pauses_at_divergence = !options_.ends_at_divergence;
}

void Runner::restart_schedule() {
  // The schedule is counted from an anchor and not from the last step, so that the errors of single sleeps
  // do not add up.
  anchor_wall_ = measured_ = Clock::now();
  anchor_steps_ = twin_.steps();
  anchor_speed_ = twin_.time_control().speed;
}

bool Runner::pace_changed() const {
  return anchor_speed_ != twin_.time_control().speed;
}

// An edit has replaced the world by one with another step: what was simulated so far keeps its length.
void Runner::notice_step_size() {
  const Duration now = twin_.step_size();
  if (now == step_size_) return;
  taken_ += twin_.steps() - counted_;
  simulated_ += static_cast<std::int64_t>(twin_.steps() - counted_) * step_size_;
  counted_ = twin_.steps();
  step_size_ = now;
  restart_schedule();
  meter_.restart(anchor_wall_, anchor_steps_, phases());
}

bool Runner::duration_reached() const {
  if (!options_.duration) return false;
  const Duration simulated = simulated_ + static_cast<std::int64_t>(twin_.steps() - counted_) * step_size_;
  return simulated + step_size_ > *options_.duration;
}

Runner::Clock::time_point Runner::due_time() const {
  const double simulated_ns =
      static_cast<double>(twin_.steps() - anchor_steps_) * static_cast<double>(step_size_.count());
  return anchor_wall_ + std::chrono::nanoseconds(static_cast<std::int64_t>(simulated_ns / anchor_speed_));
}

Runner::Clock::time_point Runner::keep_pace(Clock::time_point now, const std::atomic<bool>& stop) {
  if (pace_changed()) {
    restart_schedule();
    meter_.restart(anchor_wall_, anchor_steps_, phases());
    now = anchor_wall_;
  }
  twin_.bus().set_edge_share(kMinEdgeShare);
  if (anchor_speed_ <= 0.0) return now;
  // At a slow pace, requests are handled between two steps, and a pause or a new speed takes effect at
  // once.
  while (due_time() - now > kMaxSleep) {
    twin_.bus().set_edge_share(kEdgeShareWithIdleTime);
    sleep_until(now + kMaxSleep);
    handle_requests();
    notice_step_size();
    now = Clock::now();
    publish_status(now);
    if (stop.load(std::memory_order_relaxed) || twin_.time_control().paused || pace_changed()) return now;
  }
  twin_.bus().set_edge_share(kMinEdgeShare);
  const auto due = due_time();
  if (now < due) {
    twin_.bus().set_edge_share(kEdgeShareWithIdleTime);
    sleep_until(due);
    now = Clock::now();
  }
  const auto late = now - due;
  statistics_.lateness.add(late);
  // A loop that cannot keep the pace does not try to catch up, which would run it at full speed afterwards;
  // the schedule begins anew and the overrun is counted.
  if (late > kMaxScheduleLag) {
    ++statistics_.overruns;
    view_.overruns.store(statistics_.overruns, std::memory_order_relaxed);
    restart_schedule();
  }
  return now;
}

LoopPhases Runner::phases() const {
  LoopPhases phases = twin_.step_phases();
  phases.physics = step_ - phases.control - phases.publish;
  phases.bus = bus_;
  phases.idle = idle_;
  return phases;
}

// Waits until a step is due and only then handles received messages, so that a command takes effect in the
// first step after its arrival.
void Runner::begin_step(const std::atomic<bool>& stop) {
  const auto after_bus = Clock::now();
  bus_ += after_bus - measured_;
  const auto due = keep_pace(after_bus, stop);
  idle_ += due - after_bus;
  handle_requests();
  if (options_.before_step) options_.before_step();
  notice_step_size();
  measured_ = Clock::now();
  bus_ += measured_ - due;
}

void Runner::step_and_measure() {
  const auto begun = measured_;
  take_step();
  measured_ = Clock::now();
  step_ += measured_ - begun;
}

void Runner::publish_status(Clock::time_point now) {
  if (!twin_.time_control().paused && meter_.update(now, twin_.steps(), phases(), twin_.step_size()))
    view_.real_time_factor.store(meter_.averages().real_time_factor, std::memory_order_relaxed);
  const auto held = twin_.hold();
  status_.publish_due({twin_.now(), twin_.steps(), twin_.time_control(), meter_, statistics_, twin_.robots()},
                      now);
}

void Runner::rest_while_paused(const std::atomic<bool>& stop) {
  const auto paused_at = Clock::now();
  twin_.bus().set_edge_share(kEdgeShareWithIdleTime);
  view_.paused.store(true, std::memory_order_relaxed);
  view_.real_time_factor.store(0.0, std::memory_order_relaxed);
  meter_.restart(paused_at, twin_.steps(), phases());
  TimeControl& control = twin_.time_control();
  while (control.paused && !stop.load(std::memory_order_relaxed) && !ends_diverged()) {
    // Steps that a paused twin was asked for, by the page or a service, run in portions, so that a request
    // to stop is heard.
    const std::uint64_t steps = std::min(control.steps_owed, kStepsAtOnce);
    for (std::uint64_t i = 0; i < steps && !twin_.diverged(); ++i) take_step();
    control.steps_owed -= steps;
    if (steps > 0) twin_.publish_state();
    publish_status(Clock::now());
    if (control.steps_owed == 0) sleep_until(Clock::now() + kPausedPollInterval);
    handle_requests();
    notice_step_size();
  }
  view_.paused.store(false, std::memory_order_relaxed);
  statistics_.wall -= Clock::now() - paused_at;
  restart_schedule();
  meter_.restart(anchor_wall_, anchor_steps_, phases());
}

RunStatistics Runner::run(const std::atomic<bool>& stop) {
  const StallWatch watch(*this);
  prctl(PR_SET_TIMERSLACK, 1);  // the default slack lets the kernel wake this thread up to 50 us late
  const auto begin_wall = Clock::now();
  counted_ = twin_.steps();
  taken_ = 0;
  step_size_ = twin_.step_size();
  simulated_ = {};
  statistics_ = {};
  restart_schedule();
  meter_.restart(begin_wall, counted_, phases());
  statistics_.end = RunEnd::duration_reached;
  while (!duration_reached()) {
    if (stop.load(std::memory_order_relaxed)) {
      statistics_.end = RunEnd::stopped;
      break;
    }
    begin_step(stop);
    if (ends_diverged()) {
      statistics_.end = RunEnd::diverged;
      break;
    }
    if (twin_.time_control().paused) {
      rest_while_paused(stop);
      continue;
    }
    step_and_measure();
    if (on_first_step_) {
      const auto held = twin_.hold();
      enter(Activity::requests);  // the network starts here, which may take longer than a step
      std::exchange(on_first_step_, nullptr)();
    }
    publish_status(measured_);
  }
  if (statistics_.end == RunEnd::duration_reached)
    keep_pace(Clock::now(), stop);  // the duration of the last step has to pass, too
  twin_.bus().set_edge_share(0);
  statistics_.wall += Clock::now() - begin_wall;
  statistics_.steps = taken_ + twin_.steps() - counted_;
  statistics_.simulated = simulated_ + static_cast<std::int64_t>(twin_.steps() - counted_) * step_size_;
  return statistics_;
}

}  // namespace doppel
