#pragma once
// Servos drawn by seed on a rig of one axis, and a recording of them by an integrator that shares nothing
// with the fit: explicit, 20 us.

#include <cstdint>

#include "doppel/review/identification/servo_fit.h"

namespace doppel {

struct DrawnServo {
  ServoValues values{};
  ServoValues start{};     // a description that is wrong by up to a factor of 2 in each value
  double inertia = 0;      // kg m^2, of the link
  double gravity = 0;      // N m, largest moment
  double phase = 0;        // rad, of the moment at q = 0
  std::uint64_t seed = 0;  // of the motion, and of the times of the samples
};

inline constexpr double kTick4096 = 2 * 3.14159265358979323846 / 4096;  // rad

// The values above `rung` are zero; backlash is not drawn.
DrawnServo draw_servo(std::uint64_t seed, FrictionRung rung);
// 30 s Fourier series, 12 s steps, 12 s triangle; commands at 100 Hz, positions rounded to ticks at times
// that vary by 1 ms and are stamped with an error of 0.1 ms.
JointRecord recording_of(const DrawnServo& servo);
// The same motion, and behind it `lifts` times 4 s: the joint is lifted, rests, and its torque is off until
// it has fallen by 0.5 rad, is at 60 % of its speed limit, or a second is over; it is caught where it is.
JointRecord recording_with_releases(const DrawnServo& servo, int lifts);
// Steps of 0.05 rad in place of the motion, at positions where the limits do not act.
JointRecord recording_of_steps(const DrawnServo& servo, int lifts);

}  // namespace doppel
