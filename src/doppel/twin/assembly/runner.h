#pragma once
// Runs a twin: steps it in pace with wall-clock time (or as fast as possible), pauses it, ends it, and
// publishes /doppel/status and /diagnostics. The calling thread becomes the loop's thread.

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>

#include "doppel/base/core/lateness_histogram.h"
#include "doppel/export.h"
#include "doppel/physics/contract/step_loop.h"
#include "doppel/twin/assembly/status_publisher.h"
#include "doppel/twin/assembly/twin.h"
#include "doppel/twin/loop/loop_meter.h"
#include "doppel/twin/loop/time_control.h"

namespace doppel {

struct RunnerOptions {
  double speed = 1.0;                // simulated seconds per wall second; 0: as fast as possible
  std::optional<Duration> duration;  // simulated; none: until stopped
  // The run ends when the physics diverges. Otherwise the twin is paused at its last finite state, so that
  // clients can look at it and reset it.
  bool ends_at_divergence = false;
  // Called from another thread when the loop makes no progress for kLoopStall of wall-clock time, with what
  // it is in, and when it goes on. Empty: not watched.
  std::function<void(const std::string&)> report_stall = {};
  // Called before each step, and may wait, for instance for a disk. Empty: nothing is.
  std::function<void()> before_step = {};
};
inline constexpr std::chrono::milliseconds kLoopStall{2000};

struct DOPPEL_API RunStatistics {
  RunEnd end = RunEnd::stopped;
  Duration simulated{};             // in this run
  std::chrono::nanoseconds wall{};  // without pauses
  std::uint64_t steps = 0;
  std::uint64_t overruns = 0;  // how often the loop was 100 ms late and its schedule was moved
  LatenessHistogram lateness;  // empty at full speed
  [[nodiscard]] double real_time_factor() const;
};

// Values that other threads may read while it runs.
struct RunnerView {
  std::atomic<double> real_time_factor{0};  // over the last half second
  std::atomic<bool> paused{false};
  std::atomic<std::uint64_t> overruns{0};
};

class DOPPEL_API Runner {
 public:
  Runner(Twin& twin, RunnerOptions options);

  // Runs until the duration is over, `stop` becomes true, or the physics diverges (RunnerOptions).
  RunStatistics run(const std::atomic<bool>& stop);
  [[nodiscard]] const RunnerView& view() const { return view_; }
  // Called once, after the first step, when the first state has been published.
  void on_first_step(std::function<void()> callback) { on_first_step_ = std::move(callback); }

 private:
  using Clock = std::chrono::steady_clock;
  class StallWatch;
  enum class Activity : int { requests, step };  // what the loop is in
  void enter(Activity what) {
    activity_.store(what, std::memory_order_relaxed);
    progress_.fetch_add(1, std::memory_order_relaxed);
  }
  void handle_requests();  // between steps
  void continue_from_other_step(std::uint64_t before);
  void take_step();
  void rest_while_paused(const std::atomic<bool>& stop);
  void begin_step(const std::atomic<bool>& stop);
  [[nodiscard]] bool pace_changed() const;
  void notice_step_size();
  [[nodiscard]] bool duration_reached() const;
  [[nodiscard]] bool ends_diverged() const { return options_.ends_at_divergence && twin_.diverged(); }
  void step_and_measure();
  // Sleeps until the next step is due and returns the time then. Requests are handled meanwhile if the wait
  // is long.
  Clock::time_point keep_pace(Clock::time_point now, const std::atomic<bool>& stop);
  // When the step after those taken so far is due.
  [[nodiscard]] Clock::time_point due_time() const;
  void restart_schedule();
  void publish_status(Clock::time_point now);
  [[nodiscard]] LoopPhases phases() const;

  Twin& twin_;
  RunnerOptions options_;
  RunStatistics statistics_;
  RunnerView view_;
  std::function<void()> on_first_step_;
  // The schedule: the step after which the step count is `anchor_steps_` was due at `anchor_wall_`.
  Clock::time_point anchor_wall_;
  std::uint64_t anchor_steps_ = 0;
  double anchor_speed_ = 1.0;
  // An edit may change the size of a step, and a restored state the number of steps: `taken_` steps of this
  // run, up to the number `counted_`, have simulated `simulated_`; later ones take `step_size_`.
  Duration step_size_{}, simulated_{};
  std::uint64_t counted_ = 0, taken_ = 0;
  LoopMeter meter_;
  Clock::time_point measured_;                        // end of the wall-clock time accounted for below
  std::chrono::nanoseconds bus_{}, idle_{}, step_{};  // since the run began
  StatusPublisher status_;
  std::atomic<std::uint64_t> progress_{0};
  std::atomic<Activity> activity_{Activity::requests};
};

}  // namespace doppel
