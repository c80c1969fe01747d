#pragma once
// Inverse dynamics and the joint-space inertia, independent of any physics engine: they determine the servos'
// stiffness, predict sag, and are the reference of the engines' contract tests. q [nq], v and a [nv] are in
// rad, m and their rates.

#include "doppel/export.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {

// Recursive Newton-Euler (Featherstone 2008, table 5.1): data.tau [nv] that gives acceleration a at (q, v)
// under gravity (m/s^2, world axes). Damping, friction and limits are not included. Every joint is free, also
// mimics. A weightless link (ModelLink) has inertia without weight.
DOPPEL_API void inverse_dynamics(const Model& model, Data& data, const ConstVector& q, const ConstVector& v,
                                 const ConstVector& a, const Eigen::Vector3d& gravity);

// inverse_dynamics at rest: data.tau [nv], N m or N, that holds the robot against gravity.
DOPPEL_API void gravity_torques(const Model& model, Data& data, const ConstVector& q,
                                const Eigen::Vector3d& gravity);

// Composite rigid body algorithm (Featherstone 2008, table 6.2): data.M [nv, nv], kg m^2 or kg, symmetric.
DOPPEL_API void mass_matrix(const Model& model, Data& data, const ConstVector& q);

// For each scalar joint, the load on its drive at rest, from data.tau of gravity_torques(): its own plus that
// of its mimics (leader: tau_l + sum multiplier * tau_m; a mimic: 0). [joints] N m or N; 0 for joints that
// are not scalar.
DOPPEL_API void drive_torques(const Model& model, const Data& data, Eigen::VectorXd& out);

inline constexpr int kConfigurationSamples = 128;

// `count` configurations [nq] (rad, m) spread evenly within the limits (mimics follow), the first one
// neutral; the same in every call.
DOPPEL_API std::vector<Eigen::VectorXd> sample_configurations(const Model& model, int count);

// For each joint, the largest inertia that its drive carries over kConfigurationSamples configurations of
// sample_configurations(), mimics included. [joints] kg m^2 or kg.
DOPPEL_API Eigen::VectorXd carried_inertia(const Model& model);

}  // namespace doppel
