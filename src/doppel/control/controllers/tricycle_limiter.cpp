#include "doppel/control/controllers/detail/tricycle_limiter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

constexpr double kNoUpperLimit = 1000.0;  // as in ros2_controllers, where only the minimum is set

}  // namespace

Status MagnitudeRange::complete(const char* what) {
  if (std::isnan(min) && std::isnan(max)) return {};
  if (std::isnan(max)) max = kNoUpperLimit;
  if (std::isnan(min)) min = 0;
  if (min < 0 || max < 0)
    return Status::refused(fmt::format(
        "the limits of {} are {:g} and {:g}, but they are magnitudes for both directions", what, min, max));
  if (min > max)
    return Status::refused(
        fmt::format("the minimum of {}, {:g}, is above its maximum, {:g}", what, min, max));
  return {};
}

double MagnitudeRange::clamp(double value, double scale) const {
  if (std::isnan(max)) return value;
  return std::copysign(std::clamp(std::abs(value), min * scale, max * scale), value);
}

Status TractionLimits::complete() {
  if (Status fine = velocity.complete("traction.velocity"); !fine) return fine;
  if (Status fine = acceleration.complete("traction.acceleration"); !fine) return fine;
  if (Status fine = deceleration.complete("traction.deceleration"); !fine) return fine;
  return jerk.complete("traction.jerk");
}

// The jerk is over two steps, as in ros2_controllers: it limits the second difference by 2 j dt^2.
double TractionLimits::limit(double wanted, const LastTwo& past, double dt) const {
  const double slope = past.last - past.before;
  double value = past.last + slope + jerk.clamp(wanted - past.last - slope, 2 * dt * dt);
  const bool grows = std::abs(value) >= std::abs(past.last);
  value = past.last + (grows ? acceleration : deceleration).clamp(value - past.last, dt);
  return velocity.clamp(value);
}

Status SteeringLimits::complete() {
  if (std::isnan(max_position)) max_position = -min_position;
  if (std::isnan(min_position)) min_position = -max_position;
  if (min_position > max_position)
    return Status::refused(fmt::format("steering.min_position, {:g}, is above steering.max_position, {:g}",
                                       min_position, max_position));
  if (Status fine = velocity.complete("steering.velocity"); !fine) return fine;
  return acceleration.complete("steering.acceleration");
}

double SteeringLimits::limit(double wanted, const LastTwo& past, double dt) const {
  const double slope = past.last - past.before;
  double value = past.last + slope + acceleration.clamp(wanted - past.last - slope, 2 * dt * dt);
  value = past.last + velocity.clamp(value - past.last, dt);
  return std::isnan(max_position) ? value : std::clamp(value, min_position, max_position);
}

}  // namespace doppel
