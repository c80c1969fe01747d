#pragma once
// The safety of a joint's motion between controllers and a servo: which samples are believed, and which
// goals are sent. It knows nothing of buses and time but the numbers that it gets, and allocates nothing.
// None of this is a safety function in the sense of a standard.

#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "doppel/base/core/time.h"
#include "doppel/export.h"

namespace doppel {

struct GuardLimits {
  double lower = -std::numeric_limits<double>::infinity();  // rad or m
  double upper = std::numeric_limits<double>::infinity();
  double velocity = 1;            // rad/s or m/s, of the joint
  bool stalls_by_intent = false;  // a gripper: the stall guard is off
  double ahead = 0.05;            // s of motion that a goal may be ahead of the newest sample
};

// A joint that is meant to stall, by its name.
[[nodiscard]] DOPPEL_API bool looks_like_gripper(std::string_view joint);

// Acts of the guard; each is an event when it begins.
enum GuardEvent : unsigned {
  kClampedStep = 1,     // a command was further than 1.2 of the speed limit permits in a cycle
  kClampedLimit = 2,    // a command beyond the joint's limits
  kStalled = 4,         // the joint is blocked: the goal yields
  kReleased = 8,        // it is no longer blocked
  kHalvedSpeed = 16,    // hot
  kDroppedSample = 32,  // a sample that the joint cannot have reached
};

class DOPPEL_API JointGuard {
 public:
  explicit JointGuard(const GuardLimits& limits) : limits_(limits) {}

  // The joint is at q, and stays there. Forgets what was before.
  void begin(double q, Time when);
  // Commands are stretched to a quarter of the speed.
  void set_gentle(bool gentle) { gentle_ = gentle; }

  // A sample of the servo. A position that needs more than 1.5 of the speed limit since the last one is
  // dropped, unless the next one agrees with it: a sum of eight bits passes one of 256 damaged frames.
  void take(double q, double v, double load, Time when);
  // Degrees Celsius; NaN: not known.
  void take_temperature(double temperature);

  // The goal to be sent in this cycle. `command`: NaN is none, and the goal stays. The goal moves at 1.2 of
  // the speed limit at most (gentle: at a quarter of it; hot: at half of it), stays within the limits, and
  // is at most GuardLimits::ahead of the joint, because a servo without a watchdog goes on to its last goal
  // when the host is gone.
  double goal(double command, Duration period);
  // The joint stays where it is: the goal is its present position.
  void hold();

  [[nodiscard]] double position() const { return position_; }
  [[nodiscard]] double sent_goal() const { return goal_; }
  [[nodiscard]] bool is_stalled() const { return stalled_; }
  // Events since the last call.
  unsigned take_events();

 private:
  void watch_stall(Time when);
  [[nodiscard]] double fastest() const;
  void raise(GuardEvent event);
  void end(GuardEvent event) { active_ &= ~static_cast<unsigned>(event); }

  GuardLimits limits_;
  double position_ = 0, velocity_ = 0, load_ = 0;
  double goal_ = 0, wish_ = 0;  // wish: the last command within the limits
  std::optional<double> doubted_;
  Time seen_{}, doubted_when_{};
  std::optional<Time> blocked_since_;
  bool gentle_ = false, stalled_ = false, hot_ = false;
  unsigned events_ = 0, active_ = 0;
};

}  // namespace doppel
