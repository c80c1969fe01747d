#include "doppel/review/identification/detail/release_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/hardware/hardware.h"

namespace doppel::identification_detail {
namespace {

constexpr int kLifts = 81;            // positions that are tried
constexpr double kFallStep = 5e-4;    // s
constexpr double kCatchTime = 0.035;  // s, a sample, two missing cycles and the torque's registers
constexpr double kMinTurnFall = 0.05, kMinSlideFall = 0.005;  // rad, m
constexpr double kMinMoment = 2.5;                            // of the friction, so that the joint falls
constexpr double kMinTorque = 1e-3;                           // N m or N: less is none
constexpr double kFreeTurn = 2.0, kFreeSlide = 0.2;           // rad/s, m/s, of a joint without a limit
constexpr double kSlower = 3, kMoreTime = 0.2;                // s: a fall with friction takes longer
constexpr double kAside = 0.03;                               // of the span: how far it may be above the lift

struct Fall {
  double way = 0, time = 0;  // rad or m, s: until it is caught
  double speed = 0;          // the largest
};

class Falls {
 public:
  explicit Falls(const FallingJoint& joint) : joint_(joint) {
    const double limit = std::isfinite(joint.speed) && joint.speed > 0 ? joint.speed
                         : joint.slides                                ? kFreeSlide
                                                                       : kFreeTurn;
    fastest_ = kExcitationSpeed * limit;
  }

  // Without friction, until one more step could not be caught within the speed or the span.
  [[nodiscard]] Fall fall(double lift) const {
    Fall out;
    double q = lift, v = 0;
    while (out.time < kMaxRelease) {
      const double a = -joint_.load(q) / joint_.inertia(q);
      const double next = v + kFallStep * a;
      if (out.time > 0 && next * v <= 0) break;  // beyond the lowest position it turns back
      if (!is_caught(q, next, a)) break;
      v = next;
      q += kFallStep * v;
      out.time += kFallStep;
      out.speed = std::max(out.speed, std::abs(v));
    }
    out.way = q - lift;
    return out;
  }

 private:
  // From the decision on it falls on, and then the drive brakes it.
  [[nodiscard]] bool is_caught(double q, double v, double a) const {
    const double reached = v + (v * a > 0 ? a * kCatchTime : 0.0);
    if (std::abs(reached) > fastest_) return false;
    double end = q + reached * kCatchTime;
    if (std::isfinite(joint_.effort)) {
      const double left = kMaxEffort * joint_.effort - std::abs(joint_.load(q));
      if (!(left > 0)) return false;
      end += std::copysign(0.5 * joint_.inertia(q) * reached * reached / left, v);
    }
    return end >= joint_.low && end <= joint_.high;
  }

  const FallingJoint& joint_;
  double fastest_ = 0;
};

}  // namespace

std::string plan_release(const FallingJoint& joint, PlannedRelease& out) {
  const Falls falls(joint);
  const double least = joint.slides ? kMinSlideFall : kMinTurnFall;
  // The interval has room on both sides of the lift, where the drive sags and positions are rounded.
  const double aside = kAside * (joint.high - joint.low);
  double most = 0, longest = 0, best = 0;
  for (int i = 0; i < kLifts; ++i) {
    const double share = static_cast<double>(i) / (kLifts - 1);
    const double lift = joint.low + aside + (joint.high - joint.low - 2 * aside) * share;
    const double moment = std::abs(joint.load(lift));
    most = std::max(most, moment);
    const bool held = moment + joint.friction <= kMaxEffort * joint.effort;
    if (moment < std::max(kMinMoment * joint.friction, kMinTorque) || !held) continue;
    const Fall fall = falls.fall(lift);
    longest = std::max(longest, std::abs(fall.way));
    const double worth = std::abs(fall.way) * fall.time;
    if (std::abs(fall.way) < least || worth <= best) continue;
    best = worth;
    const double end = lift + fall.way;
    out = {lift, std::max(joint.low, std::min(end, lift - aside)),
           std::min(joint.high, std::max(end, lift + aside)), fall.speed,
           std::min(kMaxRelease, kSlower * fall.time + kMoreTime)};
  }
  if (best > 0) return "";
  if (most < kMinTorque) return "gravity has no moment about its axis: lay the arm down";
  if (most < kMinMoment * joint.friction)
    return fmt::format(
        "gravity's moment of at most {:.3g} is not {:g} times its friction of {:.3g}, so that it would "
        "not fall",
        most, kMinMoment, joint.friction);
  return fmt::format(
      "without friction it could be caught within {:.0f} % of its speed limit and within its free span only "
      "after "
      "{:.3g} {}, of which {:g} are needed",
      100 * kExcitationSpeed, longest, joint.slides ? "m" : "rad", least);
}

}  // namespace doppel::identification_detail
