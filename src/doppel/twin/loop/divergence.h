#pragma once
// Why the physics diverged, and whether it would: a step whose result is not finite leaves the engine at the
// last finite state (engine.h), which shows what moved out of bounds.

#include <string>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

// The part that moves fastest, each joint and free body measured by what is fast for it: "the fastest is
// joint 'elbow' of 'arm' at 2e+09 rad/s". Empty: nothing moves.
[[nodiscard]] DOPPEL_API std::string fastest_motion(const Engine& engine);

// Steps a copy of the state for `duration` with the drives and loads that it has. Empty: it stays finite;
// else when it diverges, and what moves. Allocates.
[[nodiscard]] DOPPEL_API std::string divergence_within(const Engine& engine, Duration duration);

// True if the world diverges within a few steps, as when something is spawned deep inside of another body:
// when, and what moves. Empty: it does not, or had diverged before.
[[nodiscard]] DOPPEL_API std::string spawned_divergence(const Engine& engine);

}  // namespace doppel
