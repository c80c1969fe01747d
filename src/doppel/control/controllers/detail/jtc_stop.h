#pragma once
// Trajectories that the controller makes itself: holding a position, and braking to rest. In the
// loop; no allocation.

#include <span>

#include "doppel/control/controllers/detail/jtc_settings.h"
#include "doppel/control/controllers/detail/trajectory.h"

namespace doppel::jtc {

// One point at time 0: at `positions` (rad or m), with zero for the other commanded fields.
void make_hold(const Settings& settings, std::span<const double> positions, Trajectory& hold);

// One point at time 0: the last one of `done` with all of its fields.
void make_success_hold(const Trajectory& done, Trajectory& hold);

// Every joint brakes independently at its constant deceleration d > 0 (rad/s^2 or m/s^2) and then is at
// rest: after the time |v| / d and the distance v^2 / (2 d). Needs room for joints + 1 points; between them
// a cubic is exact.
void make_stop(std::span<const double> positions, std::span<const double> velocities,
               std::span<const double> deceleration, Trajectory& stop);

}  // namespace doppel::jtc
