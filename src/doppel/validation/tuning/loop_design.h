#pragma once
// Gains of a joint's position loop from a model of the joint: an inertia that changes with the pose, a delay,
// and a controller that commands effort (PID on a double integrator) or velocity (PI on an integrator behind
// the servo). Poles are placed (Astrom, Murray, Feedback Systems, 12.3) at the highest bandwidth that leaves
// the margins.

#include <complex>
#include <limits>
#include <optional>
#include <string>

#include "doppel/export.h"
#include "doppel/validation/metrics/margins.h"
#include "doppel/validation/metrics/relay.h"

namespace doppel {

enum class LoopKind { effort, velocity };

// SI units of a revolute joint; a slide has N, m and kg in place of N m, rad and kg m^2.
struct JointPlant {
  LoopKind kind = LoopKind::effort;
  double least_inertia = 0, most_inertia = 0;     // kg m^2, over the configurations, with and without payload
  double damping = 0, friction = 0;               // N m s/rad, N m
  double delay = 0;                               // s, from a measurement to the effort that answers it
  double servo_stiffness = 0, servo_damping = 0;  // of a velocity command's drive
  double effort = std::numeric_limits<double>::infinity();  // limit, N m
  double speed = std::numeric_limits<double>::infinity();   // limit, rad/s
  double gravity = 0;                                       // N m: the largest load at rest
  double step = 0.5;                                        // rad: of T4
  double integral_pole = 0.25;                              // of the bandwidth, of effort loops
};

// The parallel form: command = p e + clamp(i integral(e), +-clamp) + d de/dt.
struct LoopGains {
  double p = 0, i = 0, d = 0;
  double clamp = std::numeric_limits<double>::infinity();  // of the integral term
};

// The margins that a design leaves at the least and at the most inertia.
inline constexpr double kPhaseMargin = 0.7853981633974483;  // rad: 45 deg
inline constexpr double kGainMargin = 1.9952623149688795;   // 6 dB

// The reason why a design has no higher bandwidth.
enum class DesignLimit { ceiling, delay, effort, speed };

struct DOPPEL_API LoopDesign {
  double bandwidth = 0;  // rad/s: the natural frequency at the most inertia
  LoopGains gains;
  LoopMargins at_least, at_most;  // at the least and the most inertia
  DesignLimit limit = DesignLimit::ceiling;

  [[nodiscard]] DOPPEL_API double phase_margin() const;  // rad, the smaller one; 0: unstable
  [[nodiscard]] DOPPEL_API double gain_margin() const;   // factor, the smaller one; infinite: none limits it
};

// L(j w) of the loop with this inertia.
DOPPEL_API std::complex<double> open_loop(const JointPlant& plant, const LoopGains& gains, double inertia,
                                          double w);

// Effort: at the most inertia J the poles (s + w)^2 (s + a w) with the plant's integral_pole a:
// K = J w^2 (1 + 2 a), D = J w (2 + a) - damping, and an integral that is bounded by what it has to hold,
// gravity and friction: without the bound a step would overshoot by the share 2 a. Velocity: poles at w and
// kDriftPole w, which overshoots by kDriftPole. Rounded to four digits, as they are written.
inline constexpr double kDriftPole = 0.005;
inline constexpr double kClampOfGravity = 1.25, kClampOfFriction = 1.5;
DOPPEL_API LoopGains gains_at(const JointPlant& plant, double bandwidth);

// None where the bandwidth leaves no margins at all: the loop is unstable.
DOPPEL_API std::optional<LoopDesign> design_at(const JointPlant& plant, double bandwidth);

// The highest bandwidth with the margins, at which the effort limit still brakes a step of T4 without
// overshoot. `ceiling`: rad/s, not exceeded. None: no bandwidth has the margins.
DOPPEL_API std::optional<LoopDesign> fastest_design(const JointPlant& plant,
                                                    std::optional<double> ceiling = {});

// The ultimate gain and period of the loop under proportional control alone, at one inertia. None: no gain
// makes it oscillate, or every gain does.
struct UltimatePoint {
  double gain = 0, period = 0;  // N m/rad or 1/s; s
};
DOPPEL_API std::optional<UltimatePoint> ultimate_point(const JointPlant& plant, double inertia);

}  // namespace doppel
