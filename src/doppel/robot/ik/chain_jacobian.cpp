#include "doppel/robot/ik/chain_jacobian.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace doppel {

Eigen::Matrix<double, 6, Eigen::Dynamic> chain_jacobian(const Chain& chain, const Eigen::VectorXd& u) {
  Pose X = Pose::Identity();
  std::vector<Eigen::Vector3d> z, p;
  for (const ChainJoint& joint : chain.joints) {
    X = X * joint.X_PZ;
    z.emplace_back(X.linear().col(2));
    p.emplace_back(X.translation());
    const double position = joint.multiplier * u[joint.variable] + joint.offset;
    if (joint.prismatic) {
      X.translation() += position * X.linear().col(2);
    } else {
      X.linear() = X.linear() * Eigen::AngleAxisd(position, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    }
  }
  const Eigen::Vector3d tip = X * chain.X_ZT.translation();
  Eigen::Matrix<double, 6, Eigen::Dynamic> J =
      Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, chain.size());
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const ChainJoint& joint = chain.joints[i];
    Eigen::Matrix<double, 6, 1> column;
    if (joint.prismatic) {
      column << Eigen::Vector3d::Zero(), z[i];
    } else {
      column << z[i], z[i].cross(tip - p[i]);
    }
    J.col(joint.variable) += joint.multiplier * column;
  }
  return J;
}

double manipulability(const Chain& chain, const Eigen::VectorXd& u, int freedom) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> J = chain_jacobian(chain, u);
  J.bottomRows<3>() /= std::max(chain.length, 1e-6);
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
