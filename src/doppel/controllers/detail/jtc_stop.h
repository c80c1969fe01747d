#pragma once
// Trajectories that the controller makes itself: standing still, and braking to a stand. In the loop; no
// allocation.

#include <span>

#include "doppel/controllers/detail/jtc_settings.h"
#include "doppel/controllers/detail/trajectory.h"

namespace doppel::jtc {

// One point, at once: at `positions`, with zero for whatever else is commanded.
void make_hold(const Settings& settings, std::span<const double> positions, Trajectory& hold);

// One point, at once: the last of `done`, its velocity and the rest included.
void make_success_hold(const Trajectory& done, Trajectory& hold);

// Every joint brakes by itself at its constant deceleration d > 0 (rad/s^2 or m/s^2) and then stands: t = |v|
// / d after v^2 / (2 d). Needs room for joints + 1 points; between them a cubic is exact.
void make_stop(std::span<const double> positions, std::span<const double> velocities,
               std::span<const double> deceleration, Trajectory& stop);

}  // namespace doppel::jtc
