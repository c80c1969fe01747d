#pragma once
// Limits one component of a base's velocity by jerk, acceleration and velocity, in this order, as
// ros2_controllers' bases do (control_toolbox's RateLimiter). Units: m/s or rad/s and their derivatives.

#include "doppel/base/core/status.h"
#include "doppel/control/hardware/nan.h"

namespace doppel {

// NaN for a maximum: not limited; for a minimum: the negative maximum; for a deceleration or the acceleration
// in reverse: that of the other direction or sign.
struct SpeedLimits {
  double min_velocity = kNaN, max_velocity = kNaN;
  double max_acceleration = kNaN, max_deceleration = kNaN;                  // at a positive velocity
  double max_acceleration_reverse = kNaN, max_deceleration_reverse = kNaN;  // at a negative one
  double min_jerk = kNaN, max_jerk = kNaN;
};

class SpeedLimiter {
 public:
  // The last two velocities.
  struct Past {
    double last = 0, before_last = 0;
  };
  // Refuses a minimum above its maximum; the former limits stay in effect.
  Status set(SpeedLimits limits);
  void reset();  // to rest
  // The velocity that is commanded now, given the last two. dt: s, since the last one. Which accelerations
  // apply is decided by the sign of the last velocity; the jerk is limited only while the acceleration grows,
  // because limiting its decrease makes the velocity overshoot and oscillate
  // (https://github.com/ros-controls/control_toolbox/issues/240).
  double limit(double wanted, double dt);
  [[nodiscard]] double last() const { return past_.last; }
  [[nodiscard]] const Past& past() const { return past_; }
  void set_past(const Past& past) { past_ = past; }

 private:
  [[nodiscard]] double limit_jerk(double wanted, double dt) const;
  [[nodiscard]] double limit_acceleration(double wanted, double dt) const;

  SpeedLimits limits_;
  Past past_;
};

}  // namespace doppel
