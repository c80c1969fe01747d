#pragma once
// Inverse dynamics and the joint-space inertia, independent of any physics engine: they choose the servos'
// stiffness, predict sag, and are what the engines are tested against.

#include "doppel/export.h"
#include "doppel/kinematics/kinematics.h"

namespace doppel {

// Recursive Newton-Euler (Featherstone 2008, table 5.1): data.tau [nv] that gives acceleration a at (q, v)
// under gravity (m/s^2, world axes). Damping, friction and limits are not part of it. Every joint counts as
// free, mimics too.
DOPPEL_API void inverse_dynamics(const Model& model, Data& data, const ConstVector& q, const ConstVector& v,
                                 const ConstVector& a, const Eigen::Vector3d& gravity);

// inverse_dynamics at rest.
DOPPEL_API void gravity_torques(const Model& model, Data& data, const ConstVector& q,
                                const Eigen::Vector3d& gravity);

// Composite rigid body algorithm (Featherstone 2008, table 6.2): data.M [nv, nv], symmetric.
DOPPEL_API void mass_matrix(const Model& model, Data& data, const ConstVector& q);

// For each scalar joint, the torque that its drive carries at rest: gravity's plus what its mimics pass on
// (leader: tau_l + sum multiplier * tau_m; a mimic: 0). [joints], 0 for joints that are not scalar.
DOPPEL_API void drive_torques(const Model& model, const Data& data, Eigen::VectorXd& out);

inline constexpr int kConfigurationSamples = 128;

// `count` configurations spread evenly within the limits (mimics follow), the first one neutral; the same at
// every call.
DOPPEL_API std::vector<Eigen::VectorXd> sample_configurations(const Model& model, int count);

// For each joint, the largest inertia its drive carries over a spread of configurations (q within limits; a
// fixed quasi-random sample, the same at every call), mimics included. [joints], kg m^2 or kg.
DOPPEL_API Eigen::VectorXd carried_inertia(const Model& model);

}  // namespace doppel
