#include "doppel/control/controllers/detail/speed_limiter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

// The default of a lower limit is the negative upper one.
Status complete_pair(const char* what, double& lower, double upper) {
  if (std::isnan(lower)) lower = -upper;
  if (lower <= upper || std::isnan(upper)) return {};
  return Status::refused(
      fmt::format("the lower limit of {}, {:g}, is above the upper one, {:g}", what, lower, upper));
}

}  // namespace

Status SpeedLimiter::set(SpeedLimits limits) {
  if (Status fine = complete_pair("velocity", limits.min_velocity, limits.max_velocity); !fine) return fine;
  if (Status fine =
          complete_pair("acceleration from rest", limits.max_acceleration_reverse, limits.max_acceleration);
      !fine)
    return fine;
  if (!std::isnan(limits.max_acceleration)) {
    if (std::isnan(limits.max_deceleration_reverse))
      limits.max_deceleration_reverse = limits.max_acceleration;
    if (std::isnan(limits.max_deceleration)) limits.max_deceleration = limits.max_acceleration_reverse;
    if (limits.max_deceleration > limits.max_deceleration_reverse)
      return Status::refused(fmt::format("max_deceleration, {:g}, is above max_deceleration_reverse, {:g}",
                                         limits.max_deceleration, limits.max_deceleration_reverse));
  }
  if (Status fine = complete_pair("jerk", limits.min_jerk, limits.max_jerk); !fine) return fine;
  limits_ = limits;
  return {};
}

void SpeedLimiter::reset() {
  past_ = {};
}

double SpeedLimiter::limit_jerk(double wanted, double dt) const {
  if (std::isnan(limits_.max_jerk)) return wanted;
  const double change = wanted - past_.last, last_change = past_.last - past_.before_last;
  if ((change - last_change) * change <= 0) return wanted;
  const double growth =
      std::clamp(change - last_change, limits_.min_jerk * dt * dt, limits_.max_jerk * dt * dt);
  return past_.last + last_change + growth;
}

double SpeedLimiter::limit_acceleration(double wanted, double dt) const {
  if (std::isnan(limits_.max_acceleration)) return wanted;
  const double lowest = past_.last > 0 ? limits_.max_deceleration : limits_.max_acceleration_reverse;
  const double highest = past_.last < 0 ? limits_.max_deceleration_reverse : limits_.max_acceleration;
  return past_.last + std::clamp(wanted - past_.last, lowest * dt, highest * dt);
}

double SpeedLimiter::limit(double wanted, double dt) {
  double allowed = limit_acceleration(limit_jerk(wanted, dt), dt);
  if (!std::isnan(limits_.max_velocity))
    allowed = std::clamp(allowed, limits_.min_velocity, limits_.max_velocity);
  past_ = {allowed, past_.last};
  return allowed;
}

}  // namespace doppel
