#pragma once
// The motion subspace of a joint (Featherstone 2008, section 3.5). Private to this module.

#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {

using Subspace = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;  // on the stack

// S [6, nv] with V_child = X * V_parent + S * v: rows angular then linear, at the child's origin in the
// child's axes. R_JL: the child's axes in the joint frame.
inline Subspace motion_subspace(const ModelJoint& joint, const Eigen::Matrix3d& R_JL) {
  Subspace S = Subspace::Zero(6, joint.nv);
  switch (joint.type) {
    case JointType::fixed:
      break;
    case JointType::revolute:
    case JointType::continuous:
      S.col(0).head<3>() = joint.axis;
      break;
    case JointType::prismatic:
      S.col(0).tail<3>() = joint.axis;
      break;
    case JointType::planar:
      S.block<3, 2>(3, 0) = R_JL.transpose() * planar_directions(joint.axis);
      S.col(2).head<3>() = joint.axis;
      break;
    case JointType::floating:
      S.block<3, 3>(3, 0) = R_JL.transpose();
      S.block<3, 3>(0, 3).setIdentity();
      break;
  }
  return S;
}

}  // namespace doppel
