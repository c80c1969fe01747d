#pragma once
// The gyroscopic torque of a body that moves freely, for a step of the semi-implicit Euler method. Evaluated
// at the step's start it adds energy to a tumbling body at every step; evaluated at the mean of the angular
// velocities of start and end, as in the implicit midpoint rule, it keeps the energy and the magnitude of the
// angular momentum exactly (Hairer, Lubich, Wanner, *Geometric Numerical Integration*, IV.2.1).

#include <Eigen/Core>

namespace doppel {

// N m, in the principal axes: what has to be added to the torque at the step's start, -w x I w. moments: kg
// m^2; w: rad/s at the step's start; h: s. Zero where the axis of rotation is a principal one.
Eigen::Vector3d gyroscopic_correction(const Eigen::Vector3d& moments, const Eigen::Vector3d& w, double h);

}  // namespace doppel
