#pragma once
// Bodies that can exist, as points of a space without bounds.

#include <Eigen/Core>
#include <vector>

#include "doppel/robot/kinematics/dynamics_regressor.h"

namespace doppel::identification_detail {

// [[Sigma, m c], [m c', m]], Sigma = 1/2 tr(I) - I: second moments about the link's origin. It is positive
// definite if and only if a body has these parameters (Wensing, Kim, Slotine, Linear matrix inequalities for
// physically consistent inertial parameter identification, IEEE Robotics and Automation Letters 3, 2018).
Eigen::Matrix4d pseudo_inertia(const InertialParameters& parameters);
InertialParameters parameters_of(const Eigen::Matrix4d& pseudo_inertia);

// U E E' U' over all upper triangular E with a positive diagonal, about a described body U U': a log-Cholesky
// parametrisation (Rucker, Wensing, Smooth parameterization of rigid-body inertia, IEEE Robotics and
// Automation Letters 7, 2022). At 0 it is the described one.
class BodySpace {
 public:
  explicit BodySpace(const InertialParameters& described);
  [[nodiscard]] InertialParameters at(const InertialParameters& place) const;
  // d parameters / d place.
  [[nodiscard]] Eigen::Matrix<double, kInertialParameters, kInertialParameters> slope(
      const InertialParameters& place) const;

 private:
  Eigen::Matrix4d factor_;
};

// The recording's cost of combinations B p of the parameters: (b - B p)' H (b - B p) / 2.
struct CombinationCost {
  const Eigen::MatrixXd& B;
  const Eigen::MatrixXd& H;
  const Eigen::VectorXd& b;
};

// The parameters, 10 per body and then those of the drives, which are positive, with the least cost and least
// distance from the described ones: a factor of e is one sigma, of a drive's value e^3.
Eigen::VectorXd nearest_bodies(const CombinationCost& cost, const Eigen::VectorXd& described, int bodies);

}  // namespace doppel::identification_detail
