#include "doppel/robot/kinematics/kinematics.h"

#include <Eigen/Geometry>
#include <cassert>

#include "doppel/robot/kinematics/detail/joint_subspace.h"

namespace doppel {

Eigen::Matrix<double, 3, 2> planar_directions(const Eigen::Vector3d& axis) {
  return rotation_from_z(axis).leftCols<2>();
}

Pose joint_transform(const ModelJoint& joint, const ConstVector& q) {
  Pose X = Pose::Identity();
  switch (joint.type) {
    case JointType::fixed:
      break;
    case JointType::revolute:
    case JointType::continuous:
      X.linear() = Eigen::AngleAxisd(q[joint.q], joint.axis).toRotationMatrix();
      break;
    case JointType::prismatic:
      X.translation() = q[joint.q] * joint.axis;
      break;
    case JointType::planar:
      X.linear() = Eigen::AngleAxisd(q[joint.q + 2], joint.axis).toRotationMatrix();
      X.translation() = planar_directions(joint.axis) * q.segment<2>(joint.q);
      break;
    case JointType::floating: {
      const auto c = q.segment<4>(joint.q + 3);
      X.linear() = Eigen::Quaterniond(c[3], c[0], c[1], c[2]).normalized().toRotationMatrix();
      X.translation() = q.segment<3>(joint.q);
      break;
    }
  }
  return X;
}

Pose parent_to_child(const ModelJoint& joint, const ConstVector& q) {
  return joint.X_PJ * joint_transform(joint, q);
}

void forward_kinematics(const Model& model, Data& data, const ConstVector& q) {
  assert(q.size() == model.nq);
  data.X_WL[0].setIdentity();
  for (const ModelJoint& joint : model.joints) {
    data.X_WL[joint.child_link] = data.X_WL[joint.parent_link] * parent_to_child(joint, q);
  }
}

void jacobian(const Model& model, const Data& data, int link, const Eigen::Vector3d& p_LoP_L,
              Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J) {
  assert(J.cols() == model.nv);
  J.setZero();
  const Eigen::Vector3d p_WoP = data.X_WL[link] * p_LoP_L;
  for (int at = model.links[link].joint; at >= 0; at = model.links[model.joints[at].parent_link].joint) {
    const ModelJoint& joint = model.joints[at];
    const Pose& X_WC = data.X_WL[joint.child_link];
    const Eigen::Matrix3d R_WC = X_WC.linear();
    const Eigen::Matrix3d R_WJ = data.X_WL[joint.parent_link].linear() * joint.X_PJ.linear();
    const Subspace S = motion_subspace(joint, R_WJ.transpose() * R_WC);
    const Eigen::Vector3d arm = p_WoP - X_WC.translation();
    for (int k = 0; k < joint.nv; ++k) {
      const Eigen::Vector3d angular = R_WC * S.col(k).head<3>();
      J.col(joint.v + k).head<3>() = angular;
      J.col(joint.v + k).tail<3>() = R_WC * S.col(k).tail<3>() + angular.cross(arm);
    }
  }
}

Pose relative_pose(const Data& data, int link_A, int link_B) {
  return data.X_WL[link_A].inverse(Eigen::Isometry) * data.X_WL[link_B];
}

}  // namespace doppel
