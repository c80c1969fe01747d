#pragma once
// The ranges of what clients may apply to a machine or write into its state by services. They follow from the
// machine (effort limits, masses, inertias, velocity limits), leave room for any test of a real one, and keep
// a mistyped exponent from making the physics diverge (docs/simulator.md lists them).

#include "doppel/base/core/status.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

inline constexpr double kMaxEntitySpeed = 1e3;       // m/s, rad/s of a body, and of a joint without a limit
inline constexpr double kMaxTurn = 1e6;              // rad of a joint without limits
inline constexpr double kMaxTravel = 1e4;            // m of a joint without limits
inline constexpr double kMaxLimitFactor = 10;        // of a joint's effort or velocity limit
inline constexpr double kMaxLoadAcceleration = 1e4;  // m/s^2 or rad/s^2 that a load gives to what it acts on

// rad/s or m/s: kMaxLimitFactor times the velocity limit, at most kMaxEntitySpeed unless the limit itself is
// higher.
[[nodiscard]] DOPPEL_API double max_speed(const ModelJoint& joint);
// N m or N: kMaxLimitFactor times the effort limit, or the effort that accelerates the inertia that the joint
// moves at present by kMaxLoadAcceleration, whichever is larger. Precondition: joints[joint] is scalar.
[[nodiscard]] DOPPEL_API double max_effort(const Instance& instance, int joint);

// The range of a wrench on a link: the force that accelerates the whole instance by kMaxLoadAcceleration, and
// that force at four times its radius of gyration.
struct WrenchRange {
  double force = 0, moment = 0;  // N, N m
};
[[nodiscard]] DOPPEL_API WrenchRange max_wrench(const Instance& instance);

// Refused: a position (rad or m) outside the joint's limits or too far away, or a velocity that is too high.
[[nodiscard]] DOPPEL_API Status check_joint_state(const std::string& name, const ModelJoint& joint,
                                                  double position, double velocity);

}  // namespace doppel
