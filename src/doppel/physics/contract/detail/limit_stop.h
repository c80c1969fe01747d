#pragma once
// The stop at a joint's limit where the description gives it a stiffness: a spring with a damper that pushes
// the joint back and never pulls it,
//
//   tau = max(0, stiffness * depth + damping * rate of depth),   damping = 2 z sqrt(stiffness * inertia)
//
// with the damping ratio z of the restitution (speed after over speed before an impact) and the inertia that
// the joint moves when it touches. Without a stiffness the engine's own stop is used (docs/physics.md).

namespace doppel {

// The damping ratio with which a linear spring and damper that never pull return `restitution` of the speed,
// and the inverse function. Source: Schwager and Poeschel, Granular Matter 9 (2007), equation 22. The
// restitution is at least 0.024, that of kMaxDamped, because more damping would only delay the separation.
double damping_ratio_of(double restitution);
double restitution_of(double damping_ratio);
inline constexpr double kMaxDamped = 3.0;

}  // namespace doppel
