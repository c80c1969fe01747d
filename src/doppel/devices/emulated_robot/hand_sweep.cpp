#include "doppel/devices/emulated_robot/detail/hand_sweep.h"

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

constexpr double kPause = 5;          // s in the middle
constexpr double kHandSpeed = 0.8;    // rad/s or m/s
constexpr double kFreeHalfRange = 3;  // rad, of a joint without limits

}  // namespace

HandSweep::HandSweep(const std::vector<JointServo>& joints) {
  period_ = kPause;
  for (const JointServo& joint : joints) {
    Range range;
    const bool bounded = std::isfinite(joint.lower) && std::isfinite(joint.upper);
    range.middle = bounded ? (joint.lower + joint.upper) / 2 : 0;
    range.half = bounded ? (joint.upper - joint.lower) / 2 : kFreeHalfRange;
    range.quarter = range.half / std::min(kHandSpeed, joint.velocity);
    range.begin = period_;
    period_ += 4 * range.quarter;
    ranges_.push_back(range);
  }
}

void HandSweep::positions(double time, std::span<double> out) const {
  const double phase = std::fmod(time, period_);
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    const Range& range = ranges_[i];
    const double turn = (phase - range.begin) / range.quarter;  // 0 to 4 while it is its turn
    double share = 0;
    if (turn > 0 && turn < 4) share = turn < 1 ? -turn : turn < 3 ? turn - 2 : 4 - turn;
    out[i] = range.middle + share * range.half;
  }
}

}  // namespace doppel
