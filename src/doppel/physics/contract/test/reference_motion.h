#pragma once
// A motion that no physics engine integrates: the classical Runge-Kutta method with doppel's own Newton-Euler
// and composite-body algorithms (robot/kinematics/dynamics.h), for joints with one degree of freedom each.

#include <Eigen/Cholesky>

#include "doppel/robot/kinematics/dynamics.h"

namespace doppel::test {

struct Motion {
  Eigen::VectorXd q, v;
};

class ReferenceMotion {
 public:
  ReferenceMotion(const Model& model, const Eigen::Vector3d& gravity)
      : model_(model), gravity_(gravity), data_(model) {}

  // M(q), and the joint forces that gravity and Coriolis forces require.
  void evaluate(const Motion& at, Eigen::MatrixXd& M, Eigen::VectorXd& bias) {
    inverse_dynamics(model_, data_, at.q, at.v, Eigen::VectorXd::Zero(model_.nv), gravity_);
    bias = data_.tau;
    mass_matrix(model_, data_, at.q);
    M = data_.M;
  }
  // tau: of the state; joint damping is not part of it.
  template <typename Effort>
  Eigen::VectorXd acceleration(const Motion& at, const Effort& tau) {
    Eigen::MatrixXd M;
    Eigen::VectorXd bias;
    evaluate(at, M, bias);
    return M.ldlt().solve(tau(at) - bias);
  }
  template <typename Effort>
  void step(Motion& at, double h, const Effort& tau) {
    const auto moved = [&at](const Motion& by, double t) { return Motion{at.q + t * by.q, at.v + t * by.v}; };
    const auto rate = [&](const Motion& u) { return Motion{u.v, acceleration(u, tau)}; };
    const Motion k1 = rate(at), k2 = rate(moved(k1, h / 2)), k3 = rate(moved(k2, h / 2)),
                 k4 = rate(moved(k3, h));
    at.q += h / 6 * (k1.q + 2 * k2.q + 2 * k3.q + k4.q);
    at.v += h / 6 * (k1.v + 2 * k2.v + 2 * k3.v + k4.v);
  }

 private:
  const Model& model_;
  Eigen::Vector3d gravity_;
  Data data_;
};

}  // namespace doppel::test
