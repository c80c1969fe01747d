#include "doppel/control/controllers/detail/jtc_stop.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace doppel::jtc {
namespace {

Duration braking_time(double velocity, double deceleration) {
  return std::isfinite(velocity) ? from_seconds(std::abs(velocity) / deceleration) : Duration{};
}

}  // namespace

void make_hold(const Settings& settings, std::span<const double> positions, Trajectory& hold) {
  hold.clear();
  hold.add_point(Duration{});
  std::copy(positions.begin(), positions.end(), hold.give(0, Field::positions).begin());
  if (settings.commands(Kind::velocity)) hold.give(0, Field::velocities);
  if (settings.commands(Kind::acceleration)) hold.give(0, Field::accelerations);
  if (settings.commands(Kind::effort)) hold.give(0, Field::effort);
}

void make_success_hold(const Trajectory& done, Trajectory& hold) {
  hold.clear();
  hold.add_point(Duration{});
  for (const Field field : {Field::positions, Field::velocities, Field::accelerations, Field::effort}) {
    if (!done.has(done.size() - 1, field)) continue;
    const std::span<const double> last = done.values(done.size() - 1, field);
    std::copy(last.begin(), last.end(), hold.give(0, field).begin());
  }
}

void make_stop(std::span<const double> positions, std::span<const double> velocities,
               std::span<const double> deceleration, Trajectory& stop) {
  stop.clear();
  // A point now, and one at each instant at which a joint comes to rest.
  std::optional<Duration> time = Duration{};
  while (time) {
    stop.add_point(*time);
    const std::size_t point = stop.size() - 1;
    const std::span<double> p = stop.give(point, Field::positions), v = stop.give(point, Field::velocities);
    std::optional<Duration> next;
    for (std::size_t j = 0; j < positions.size(); ++j) {
      const Duration stands = braking_time(velocities[j], deceleration[j]);
      const double brake = -std::copysign(deceleration[j], velocities[j]);
      const double t = to_seconds(*time);
      if (stands > *time) {
        p[j] = positions[j] + velocities[j] * t + 0.5 * brake * t * t;
        v[j] = velocities[j] + brake * t;
        next = next ? std::min(*next, stands) : stands;
      } else {
        const double distance = stands > Duration{} ? -0.5 * velocities[j] * velocities[j] / brake : 0.0;
        p[j] = positions[j] + distance;
        v[j] = 0;
      }
    }
    time = next;
  }
}

}  // namespace doppel::jtc
