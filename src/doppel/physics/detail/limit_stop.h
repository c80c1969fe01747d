#pragma once
// The stop at a joint's limit where the description gives it a stiffness: a spring with a damper that pushes
// the joint back and never pulls it,
//
//   tau = max(0, stiffness * depth + damping * rate of depth),   damping = 2 z sqrt(stiffness * inertia)
//
// with the damping ratio z of the restitution (speed after over speed before an impact) and the inertia that
// the joint moves when it touches. Where none is given, the engine's own stop counts (docs/physics.md).

namespace doppel {

// The damping ratio with which a linear spring and damper that never pull give back `restitution` of the
// speed, and the inverse. Source: Schwager and Poeschel, Granular Matter 9 (2007), equation 22. A restitution
// below that of kMaxDamped, 0.024, counts as that: more damping would only delay the way out.
double damping_ratio_of(double restitution);
double restitution_of(double damping_ratio);
inline constexpr double kMaxDamped = 3.0;

}  // namespace doppel
