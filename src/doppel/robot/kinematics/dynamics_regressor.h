#pragma once
// Inverse dynamics as a linear function of the links' inertial parameters, for their identification.

#include <Eigen/Core>

#include "doppel/base/math/mass_properties.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {

inline constexpr int kInertialParameters = 10;  // of one link
// m, m cx, m cy, m cz in kg and kg m, and Ixx, Ixy, Ixz, Iyy, Iyz, Izz in kg m^2 about the origin of the link
// frame, in its axes.
using InertialParameters = Eigen::Matrix<double, kInertialParameters, 1>;

DOPPEL_API InertialParameters inertial_parameters(const MassProperties& body);
// Precondition: the mass is not 0.
DOPPEL_API MassProperties mass_properties(const InertialParameters& parameters);

// Y [nv, 10 * links] with tau of inverse_dynamics() = Y * parameters, link by link in the order of the model;
// links that it has without inertia have columns too. Resizes Y; data is as after inverse_dynamics().
// Source: C. Atkeson, C. An, J. Hollerbach, Estimation of inertial parameters of manipulator loads and links,
// International Journal of Robotics Research 5, 1986.
DOPPEL_API void dynamics_regressor(const Model& model, Data& data, const ConstVector& q, const ConstVector& v,
                                   const ConstVector& a, const Eigen::Vector3d& gravity, Eigen::MatrixXd& Y);

}  // namespace doppel
