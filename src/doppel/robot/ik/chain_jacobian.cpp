#include "doppel/robot/ik/chain_jacobian.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace doppel {

Eigen::Matrix<double, 6, Eigen::Dynamic> chain_jacobian(const Chain& chain, const Eigen::VectorXd& u) {
  std::vector<Eigen::Vector3d> z, p;
  const Pose X_BT = walk(chain, u, [&](std::size_t, const Eigen::Vector3d& z_B, const Eigen::Vector3d& p_B) {
    z.push_back(z_B);
    p.push_back(p_B);
  });
  Eigen::Matrix<double, 6, Eigen::Dynamic> J =
      Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, chain.size());
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const ChainJoint& joint = chain.joints[i];
    Eigen::Matrix<double, 6, 1> column;
    if (joint.prismatic) {
      column << Eigen::Vector3d::Zero(), z[i];
    } else {
      column << z[i], z[i].cross(X_BT.translation() - p[i]);
    }
    J.col(joint.variable) += joint.multiplier * column;
  }
  return J;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> scaled_jacobian(const Chain& chain, const Eigen::VectorXd& u) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> J = chain_jacobian(chain, u);
  J.bottomRows<3>() /= std::max(chain.length, 1e-6);
  return J;
}

double manipulability(const Chain& chain, const Eigen::VectorXd& u, int freedom) {
  const Eigen::Matrix<double, 6, Eigen::Dynamic> J = scaled_jacobian(chain, u);
  const Eigen::Matrix<double, 6, 6> squares = J * J.transpose();
  const Eigen::Matrix<double, 6, 1> values =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(squares, Eigen::EigenvaluesOnly)
          .eigenvalues();
  double out = 1;
  for (int i = 0; i < std::min(freedom, 6); ++i) out *= std::sqrt(std::max(0.0, values[5 - i]));
  return out;
}

double limit_distance(const Chain& chain, const Eigen::VectorXd& u) {
  double out = 1;
  for (int i = 0; i < chain.size(); ++i) {
    const double half = 0.5 * (chain.upper[i] - chain.lower[i]);
    if (!std::isfinite(half) || half <= 0) continue;
    out = std::min(out, std::min(u[i] - chain.lower[i], chain.upper[i] - u[i]) / half);
  }
  return std::max(out, 0.0);
}

}  // namespace doppel
