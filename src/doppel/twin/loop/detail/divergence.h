#pragma once
// Why the physics diverged, and whether it would: a step whose result is not finite leaves the engine at the
// last finite state (engine.h), which shows what moved out of bounds.

#include <string>

#include "doppel/physics/contract/engine.h"

namespace doppel {

// The part that moves fastest, each joint and free body measured by what is fast for it: "the fastest is
// joint 'elbow' of 'arm' at 2e+09 rad/s". Empty: nothing moves.
[[nodiscard]] std::string fastest_motion(const Engine& engine);

// Steps a copy of the state for `duration` with the drives and loads that it has. Empty: it stays finite;
// else when it diverges, and what moves. Allocates.
[[nodiscard]] std::string divergence_within(const Engine& engine, Duration duration);

}  // namespace doppel
