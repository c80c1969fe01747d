#include "doppel/robot/kinematics/dynamics_regressor.h"

#include "doppel/robot/kinematics/detail/joint_subspace.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Wrenches = Eigen::Matrix<double, 6, kInertialParameters>;  // torque, force per parameter
using Tensor = Eigen::Matrix<double, 3, 6>;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

// I w = tensor_times(w) * (Ixx, Ixy, Ixz, Iyy, Iyz, Izz).
Tensor tensor_times(const Eigen::Vector3d& w) {
  Tensor m;
  m << w.x(), w.y(), w.z(), 0, 0, 0,  //
      0, w.x(), 0, w.y(), w.z(), 0,   //
      0, 0, w.x(), 0, w.y(), w.z();
  return m;
}

// The wrench on a link at its origin, in its axes: I A + V x* I V. A is the acceleration minus gravity, so
// that `weight`, gravity or 0, gives a weightless link its weight back.
Wrenches link_wrenches(const Vector6& V, const Vector6& A, const Eigen::Vector3d& weight) {
  const Eigen::Vector3d w = V.head<3>(), dw = A.head<3>();
  const Eigen::Vector3d a = A.tail<3>() + w.cross(V.tail<3>()) + weight;  // of the origin
  Wrenches out = Wrenches::Zero();
  out.col(0).tail<3>() = a;
  out.block<3, 3>(0, 1) = -cross_matrix(a);
  out.block<3, 3>(3, 1) = cross_matrix(dw) + cross_matrix(w) * cross_matrix(w);
  out.block<3, 6>(0, 4) = tensor_times(dw) + cross_matrix(w) * tensor_times(w);
  return out;
}

}  // namespace

InertialParameters inertial_parameters(const MassProperties& body) {
  const Eigen::Matrix3d c = cross_matrix(body.com);
  const Eigen::Matrix3d I = body.I - body.mass * c * c;
  InertialParameters out;
  out << body.mass, body.mass * body.com, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2);
  return out;
}

MassProperties mass_properties(const InertialParameters& parameters) {
  const InertialParameters& p = parameters;
  MassProperties out;
  out.mass = p[0];
  out.com = p.segment<3>(1) / p[0];
  const Eigen::Matrix3d c = cross_matrix(out.com);
  out.I << p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9];
  out.I += out.mass * c * c;
  return out;
}

void dynamics_regressor(const Model& model, Data& data, const ConstVector& q, const ConstVector& v,
                        const ConstVector& a, const Eigen::Vector3d& gravity, Eigen::MatrixXd& Y) {
  inverse_dynamics(model, data, q, v, a, gravity);
  Y.setZero(model.nv, kInertialParameters * static_cast<Eigen::Index>(model.links.size()));
  for (std::size_t i = 1; i < model.links.size(); ++i) {
    const ModelLink& link = model.links[i];
    Wrenches F = link_wrenches(data.V_WL[i], data.A_WL[i],
                               link.weightless ? data.g_L[i] : Eigen::Vector3d::Zero().eval());
    const auto column = kInertialParameters * static_cast<Eigen::Index>(i);
    for (int up = link.joint; up >= 0;) {
      const ModelJoint& joint = model.joints[static_cast<std::size_t>(up)];
      const Pose& X_PL = data.X_PL[static_cast<std::size_t>(joint.child_link)];
      const Subspace S = motion_subspace(joint, joint.X_PJ.linear().transpose() * X_PL.linear());
      if (joint.nv > 0) Y.block(joint.v, column, joint.nv, kInertialParameters) = S.transpose() * F;
      const Eigen::Matrix3d R = X_PL.linear();
      F.bottomRows<3>() = (R * F.bottomRows<3>()).eval();
      F.topRows<3>() = (R * F.topRows<3>() + cross_matrix(X_PL.translation()) * F.bottomRows<3>()).eval();
      up = model.links[static_cast<std::size_t>(joint.parent_link)].joint;
    }
  }
}

}  // namespace doppel
