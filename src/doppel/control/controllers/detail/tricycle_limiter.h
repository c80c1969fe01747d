#pragma once
// The limits of tricycle_controller (ros2_controllers), which are magnitudes for both directions: of the driven wheel's
// speed, and of the steering angle. Units: rad/s of the wheel, rad of the steering, and their derivatives.

#include "doppel/base/core/status.h"
#include "doppel/control/hardware/nan.h"

namespace doppel {

// Of a magnitude; NaN for both: not limited. Of one alone, the other one is 0 or 1000.
struct MagnitudeRange {
  double min = kNaN, max = kNaN;

  // With the missing value; refuses negative values and a minimum above the maximum. `what`: "traction.velocity".
  Status complete(const char* what);
  // The value with its sign and a magnitude in the range.
  [[nodiscard]] double clamp(double value, double scale = 1) const;
};

// The two commands before, for differences.
struct LastTwo {
  double last = 0, before = 0;

  void push(double value) {
    before = last;
    last = value;
  }
};

struct TractionLimits {
  MagnitudeRange velocity, acceleration, deceleration, jerk;

  Status complete();
  // Jerk, then acceleration (deceleration where the magnitude falls), then velocity. dt: s.
  [[nodiscard]] double limit(double wanted, const LastTwo& past, double dt) const;
};

struct SteeringLimits {
  double min_position = kNaN, max_position = kNaN;  // rad; of one alone, the other one is its negative
  MagnitudeRange velocity, acceleration;

  Status complete();
  // Acceleration, then velocity, then position.
  [[nodiscard]] double limit(double wanted, const LastTwo& past, double dt) const;
};

}  // namespace doppel
