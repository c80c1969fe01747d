#include "doppel/physics/contract/detail/drive.h"

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

// Stiffness of an ideal servo in units of the carried inertia / step^2. With the damping stiffness * step the
// implicit integrator reaches the reference in one step, whatever the inertia; a load that gives the
// acceleration a leaves an error of a * step^2 / 1000.
constexpr double kIdealStiffness = 1000.0;
constexpr double kSpeedMargin = 0.01;  // of the velocity limit, over which an effort falls to zero
constexpr double kMinInertia = 1e-6;   // kg m^2 or kg
// The share of the velocity of a reference that starts at once: the joint approaches the limit without
// exceeding it.
constexpr double kShareOfStep = 0.5;
constexpr double kShareLoss = 0.05;  // of K / D: its rate of decrease while commands run ahead
constexpr double kSameSpeed = 1e-6;  // relative: rounding of targets and of the reference

}  // namespace

Drive::Drive(int joint, const ServoParameters& servo, double carried, Duration step)
    : joint_(joint), step_(to_seconds(step)), stream_gap_(kStreamGap / step) {
  ServoParameters used = servo;
  if (used.ideal) {
    used.stiffness = kIdealStiffness * std::max(carried, kMinInertia) / (step_ * step_);
    used.damping = used.stiffness * step_;
    used.effort = kInfinity;
  }
  set_servo(used);
}

void Drive::set_servo(const ServoParameters& servo) {
  servo_ = servo;
  fastest_ = servo.velocity * step_;
  // The spring of euler is explicit: one step removes the fraction h K / D of the error of a joint without
  // inertia, and a fraction above 1 would overshoot.
  servo_.damping = std::max(servo_.damping, servo_.stiffness * step_);
  furthest_ = servo_.stiffness > 0 ? servo_.effort / servo_.stiffness : kInfinity;
}

void Drive::start(DriveMode mode, double q) {
  mode_ = mode;
  follow(q);
}

void Drive::follow(double q) {
  reference_ = before_ = q;
  seen_ = 0.0;
  target_ = mode_ == DriveMode::position ? q : 0.0;
  spread_steps_ = 0;
  share_ = kShareOfStep;
  steps_since_target_ = stream_gap_ + 1;
}

void Drive::set_target(double target) {
  if (!std::isfinite(target) || target == target_) return;
  target_ = target;
  const bool streams = steps_since_target_ > 0 && steps_since_target_ <= stream_gap_;
  spread_steps_ = streams ? steps_since_target_ : 0;
  if (streams) {
    spread_ = std::abs(target_ - reference_) / static_cast<double>(spread_steps_);
  } else {
    share_ = kShareOfStep;
  }
  steps_since_target_ = 0;
}

// The share of the reference's velocity that enters the damper. A joint lags behind a moving reference by
// (1 - share) v D / K, so a share that grows makes the joint faster than its reference. It grows at the rate
// at which the joint stays within its velocity limit, which is not at all while the reference moves at the
// limit, and shrinks at a rate that costs a twentieth of the speed.
void Drive::advance_share() {
  if (steps_since_target_ > spread_steps_) return;  // no stream: the rest of the way is gone as it was begun
  const double rate = servo_.damping > 0 ? servo_.stiffness * step_ / servo_.damping : 0.0;
  const double speed = std::min(spread_, fastest_), growth = rate * (fastest_ - speed);
  if (spread_ > fastest_ * (1.0 + kSameSpeed)) {
    share_ = std::max(share_ - kShareLoss * rate, kShareOfStep);
  } else if (speed * (1.0 - share_) > growth) {
    share_ += growth / speed;
  } else {
    share_ = 1.0;
  }
}

// Returns the part of the reference's velocity that enters the damper.
double Drive::advance_position() {
  const double longest = steps_since_target_ <= spread_steps_ ? std::min(spread_, fastest_) : fastest_;
  const double way = std::clamp(target_ - reference_, -longest, longest);
  reference_ += way;
  if (!std::isfinite(longest)) return 0.0;  // a jump has no velocity
  advance_share();
  return share_ * way / step_;
}

// The reference of a velocity is the integral of a PI controller. While the damper alone needs the whole
// effort, as from standstill, it is held at the joint, so that no position is made up for afterwards.
void Drive::advance_velocity(double q, double v) {
  seen_ = std::clamp(target_, -servo_.velocity, servo_.velocity);
  if (servo_.stiffness > 0) {
    const double damper = servo_.damping * (seen_ - v);
    const double ahead = std::max(servo_.effort - damper, 0.0) / servo_.stiffness;
    const double behind = std::max(servo_.effort + damper, 0.0) / servo_.stiffness;
    before_ = reference_ = std::clamp(reference_, q - behind, q + ahead);
  }
  reference_ += seen_ * step_;
}

void Drive::advance(double q, double v) {
  ++steps_since_target_;
  before_ = reference_;
  if (!servoing()) return;
  before_ = reference_ = std::clamp(reference_, q - furthest_, q + furthest_);
  if (mode_ == DriveMode::position) {
    seen_ = advance_position();
  } else {
    advance_velocity(q, v);
  }
}

void Drive::write_law(JointSpring& spring) const {
  spring.on = mode_ != DriveMode::passive;
  spring.stiffness = servoing() ? servo_.stiffness : 0.0;
  spring.damping = servoing() ? servo_.damping : 0.0;
  // The ideal servo reaches the reference of the step's end, and its damper belongs to the integration, not
  // to the joint: it has no reference velocity.
  spring.reference = servo_.ideal ? reference_ : before_;
  spring.reference_rate = servo_.ideal ? 0.0 : (reference_ - before_) / step_;
  spring.reference_velocity = servoing() && !servo_.ideal ? seen_ : 0.0;
  spring.feed = 0.0;
  spring.low = -servo_.effort;
  spring.high = servo_.effort;
  if (mode_ == DriveMode::effort) write_effort(spring);
}

// A commanded effort accelerates the joint up to its velocity limit and does not brake it beyond.
void Drive::write_effort(JointSpring& spring) const {
  const double effort = std::clamp(target_, -servo_.effort, servo_.effort);
  if (effort == 0 || !std::isfinite(servo_.velocity) || !(servo_.velocity > 0)) {
    spring.feed = effort;
    return;
  }
  spring.damping = std::abs(effort) / (kSpeedMargin * servo_.velocity);
  spring.reference_velocity = std::copysign(servo_.velocity, effort);
  spring.low = std::min(effort, 0.0);
  spring.high = std::max(effort, 0.0);
}

}  // namespace doppel
