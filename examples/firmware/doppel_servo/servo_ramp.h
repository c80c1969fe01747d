#pragma once
// The ramp of one pulse, in whole numbers.

#include <stdint.h>

namespace doppel_servo {

constexpr uint32_t kMinPulse = 300;   // us; fewer are no servo's
constexpr uint32_t kMaxPulse = 3000;  // us

inline uint32_t integer_root(uint64_t value) {
  uint64_t root = 0;
  for (uint64_t bit = uint64_t(1) << 31; bit != 0; bit >>= 1) {
    if ((root | bit) * (root | bit) <= value) root |= bit;
  }
  return static_cast<uint32_t>(root);
}

// A pulse that follows its target with bounded speed and acceleration, in steps of 1 ms. Lengths are in 2^-32
// us and speeds per ms, so that the slowest acceleration has 12 bits. Each step takes the greatest speed from
// which the ramp still stops at the target: with v, v - a, v - 2a ... it needs stop_distance(v).
class Ramp {
 public:
  // Precondition: at rest, or nothing is changed. The numbers are in the ranges of `C`.
  void set_limits(uint32_t min, uint32_t max, uint32_t speed, uint32_t acceleration) {
    min_ = min;
    max_ = max;
    speed_ = (static_cast<int64_t>(speed) << 32) / 1000;
    acceleration_ = (static_cast<int64_t>(acceleration) << 32) / 1000000;
  }
  bool has_limits(uint32_t min, uint32_t max, uint32_t speed, uint32_t acceleration) const {
    Ramp other;
    other.set_limits(min, max, speed, acceleration);
    return min_ == min && max_ == max && speed_ == other.speed_ && acceleration_ == other.acceleration_;
  }
  uint32_t clamped(uint32_t us) const { return us < min_ ? min_ : us > max_ ? max_ : us; }
  // Precondition of both: us is within the limits.
  void begin(uint32_t us) {
    position_ = target_ = static_cast<int64_t>(us) << 32;
    velocity_ = 0;
  }
  void aim(uint32_t us) { target_ = static_cast<int64_t>(us) << 32; }
  // The target becomes the place where the pulse comes to rest soonest.
  void freeze() {
    const int64_t next = magnitude(velocity_) - acceleration_;
    const int64_t distance = next > 0 ? stop_distance(next) : 0;
    target_ = velocity_ < 0 ? position_ - distance : position_ + distance;
  }
  void step() {
    if (at_rest()) return;
    const int64_t sign = target_ < position_ ? -1 : 1;
    const int64_t distance = sign * (target_ - position_);
    const int64_t speed = sign * velocity_;  // towards the target
    const int64_t most = speed + acceleration_ < speed_ ? speed + acceleration_ : speed_;
    int64_t next = most;
    if (most > 0 && stop_distance(most) > distance) {
      const int64_t least = speed - acceleration_;
      next = greatest_speed(distance);
      if (next < least) next = least;  // too near to stop: it passes the target and returns
    }
    velocity_ = sign * next;
    position_ += velocity_;
  }
  bool at_rest() const { return velocity_ == 0 && target_ == position_; }
  uint32_t nanoseconds() const { return static_cast<uint32_t>((position_ * 1000) >> 32); }
  uint32_t microseconds() const { return static_cast<uint32_t>((position_ + (int64_t(1) << 31)) >> 32); }
  bool allows(uint32_t min, uint32_t max) const {
    return position_ >= static_cast<int64_t>(min) << 32 && position_ <= static_cast<int64_t>(max) << 32;
  }

 private:
  static int64_t magnitude(int64_t value) { return value < 0 ? -value : value; }
  int64_t stop_distance(int64_t speed) const {
    const int64_t n = speed / acceleration_;
    return (n + 1) * speed - acceleration_ * (n * (n + 1) / 2);
  }
  // The greatest speed whose stop_distance is at most that; exact in integers.
  int64_t greatest_speed(int64_t distance) const {
    const uint64_t steps = static_cast<uint64_t>(distance / acceleration_);
    const int64_t n = (static_cast<int64_t>(integer_root(8 * steps + 1)) - 1) / 2;
    return (distance + acceleration_ * (n * (n + 1) / 2)) / (n + 1);
  }

  int64_t position_ = 0, target_ = 0, velocity_ = 0, speed_ = 1, acceleration_ = 1;
  uint32_t min_ = kMinPulse, max_ = kMaxPulse;
};

}  // namespace doppel_servo
