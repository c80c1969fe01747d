#pragma once
// Motion on a model's configuration space, for finite differences.

#include <Eigen/Geometry>
#include <random>

#include "doppel/robot/kinematics/kinematics.h"

namespace doppel::test {

// q moved by the small velocity-like vector `step` [nv]: floating joints turn by the exponential in body
// axes.
inline Eigen::VectorXd moved(const Model& model, Eigen::VectorXd q, const Eigen::VectorXd& step) {
  for (const ModelJoint& joint : model.joints) {
    if (joint.type != JointType::floating) {
      q.segment(joint.q, joint.nq) += step.segment(joint.v, joint.nv);
      continue;
    }
    q.segment<3>(joint.q) += step.segment<3>(joint.v);
    const Eigen::Vector3d turn = step.segment<3>(joint.v + 3);
    Eigen::Quaterniond rotation(q[joint.q + 6], q[joint.q + 3], q[joint.q + 4], q[joint.q + 5]);
    if (turn.norm() > 0) rotation = rotation * Eigen::AngleAxisd(turn.norm(), turn.normalized());
    q.segment<4>(joint.q + 3) = rotation.coeffs();  // x y z w
  }
  return q;
}

inline Eigen::VectorXd random_configuration(const Model& model, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  return moved(model, model.neutral(),
               Eigen::VectorXd::NullaryExpr(model.nv, [&] { return 2 * unit(random); }));
}

}  // namespace doppel::test
