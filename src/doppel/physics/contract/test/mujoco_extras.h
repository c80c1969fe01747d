#pragma once
// Functions of the MuJoCo module beyond the contract, for the benchmark and for tests against independent
// dynamics. Precondition of all: the engine is MuJoCo's.

#include <span>

#include "doppel/physics/contract/engine.h"

namespace doppel {

// Steps a copy of the engine's data on the same compiled model with mj_step alone, from the current state
// with the controls of the last step. Returns steps per second of wall-clock time.
double measure_bare_step_rate(const Engine& engine, int steps);

// MuJoCo's own inverse dynamics at the engine's state: the tau (N m, N) that gives the acceleration (rad/s^2,
// m/s^2; both [nv of all instances]) against gravity, bias, damping, friction and contacts. Precondition: the
// world has no floating joint.
void mujoco_inverse_dynamics(const Engine& engine, std::span<const double> acceleration,
                             std::span<double> tau);

// True if the first half of a step with empty contact rules (engines/mujoco/contact_rules.h) gives
// bit-identical contacts, constraints, inertia and bias to that of MuJoCo's own mj_step1, at the engine's state.
bool empty_contact_rules_change_nothing(const Engine& engine);
// The same with the rules of the engine's world.
bool contact_rules_change_nothing(const Engine& engine);

// Raises an error inside MuJoCo, on a copy of the engine's data, below a frame that holds something. True:
// the error became a result, and the frame was left properly.
bool mujoco_error_unwinds(const Engine& engine);

// The largest difference of the accelerations of the next step, solved island by island
// (engines/mujoco/islands.h) and by MuJoCo as one problem, over the largest acceleration.
double difference_of_islands(const Engine& engine);

}  // namespace doppel
