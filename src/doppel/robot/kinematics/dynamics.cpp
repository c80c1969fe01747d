#include "doppel/robot/kinematics/dynamics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "doppel/robot/kinematics/detail/joint_subspace.h"

namespace doppel {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using SmallMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;  // on the stack

Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

// Motion transform from the parent: (angular, linear) at the child's origin in the child's axes (Featherstone
// 2008, section 2.8).
Vector6 motion_to_child(const Pose& X_PL, const Vector6& V) {
  const Eigen::Matrix3d R_LP = X_PL.linear().transpose();
  Vector6 out;
  out.head<3>() = R_LP * V.head<3>();
  out.tail<3>() = R_LP * (V.tail<3>() + V.head<3>().cross(X_PL.translation()));
  return out;
}

// Force transform from the child: (torque, force) at the parent's origin in the parent's axes.
Vector6 force_to_parent(const Pose& X_PL, const Vector6& F) {
  Vector6 out;
  out.tail<3>() = X_PL.linear() * F.tail<3>();
  out.head<3>() = X_PL.linear() * F.head<3>() + X_PL.translation().cross(out.tail<3>());
  return out;
}

// Featherstone 2008, eq. 2.63: spatial inertia about the link's origin.
Matrix6 spatial_inertia(const MassProperties& body) {
  const Eigen::Matrix3d c = skew(body.com);
  Matrix6 I;
  I.topLeftCorner<3, 3>() = body.I - body.mass * c * c;
  I.topRightCorner<3, 3>() = body.mass * c;
  I.bottomLeftCorner<3, 3>() = -body.mass * c;
  I.bottomRightCorner<3, 3>() = body.mass * Eigen::Matrix3d::Identity();
  return I;
}

Vector6 motion_cross_motion(const Vector6& V, const Vector6& U) {
  Vector6 out;
  out.head<3>() = V.head<3>().cross(U.head<3>());
  out.tail<3>() = V.head<3>().cross(U.tail<3>()) + V.tail<3>().cross(U.head<3>());
  return out;
}

Vector6 motion_cross_force(const Vector6& V, const Vector6& F) {
  Vector6 out;
  out.head<3>() = V.head<3>().cross(F.head<3>()) + V.tail<3>().cross(F.tail<3>());
  out.tail<3>() = V.head<3>().cross(F.tail<3>());
  return out;
}

Subspace subspace_of(const ModelJoint& joint, const Pose& X_PL) {
  return motion_subspace(joint, joint.X_PJ.linear().transpose() * X_PL.linear());
}

// Spatial inertia of the child's subtree about the parent's origin in the parent's axes.
Matrix6 inertia_to_parent(const Pose& X_PL, const Matrix6& I) {
  Matrix6 to_child;
  const Eigen::Matrix3d R_LP = X_PL.linear().transpose();
  to_child.topLeftCorner<3, 3>() = R_LP;
  to_child.topRightCorner<3, 3>().setZero();
  to_child.bottomLeftCorner<3, 3>() = -R_LP * skew(X_PL.translation());
  to_child.bottomRightCorner<3, 3>() = R_LP;
  return to_child.transpose() * I * to_child;
}

}  // namespace

void inverse_dynamics(const Model& model, Data& data, const ConstVector& q, const ConstVector& v,
                      const ConstVector& a, const Eigen::Vector3d& gravity) {
  assert(q.size() == model.nq && v.size() == model.nv && a.size() == model.nv);
  data.V_WL[0].setZero();
  // Gravity as an upward acceleration of the base (Featherstone 2008, section 5.3): it needs no forces of its
  // own on the links.
  data.A_WL[0] << Eigen::Vector3d::Zero(), -gravity;
  data.F_L[0].setZero();
  data.g_L[0] = gravity;
  for (const ModelJoint& joint : model.joints) {
    const int child = joint.child_link;
    const Pose& X_PL = data.X_PL[child] = parent_to_child(joint, q);
    data.g_L[child] = X_PL.linear().transpose() * data.g_L[joint.parent_link];
    const Subspace S = subspace_of(joint, X_PL);
    const Vector6 V_joint = S * v.segment(joint.v, joint.nv);
    Vector6& V = data.V_WL[child];
    V = motion_to_child(X_PL, data.V_WL[joint.parent_link]) + V_joint;
    Vector6& A = data.A_WL[child];
    A = motion_to_child(X_PL, data.A_WL[joint.parent_link]) + S * a.segment(joint.v, joint.nv) +
        motion_cross_motion(V, V_joint);
    // Derivative of S for floating and planar joints: sliding directions that are fixed in the parent rotate
    // in the child.
    A.tail<3>() -= V_joint.head<3>().cross(V_joint.tail<3>());
    data.F_L[child].setZero();
    if (const auto& body = model.links[child].inertia) {
      const Matrix6 I = spatial_inertia(*body);
      data.F_L[child] = I * A + motion_cross_force(V, I * V);
      if (model.links[child].weightless) {
        const Eigen::Vector3d weight_L = body->mass * data.g_L[child];
        data.F_L[child].tail<3>() += weight_L;
        data.F_L[child].head<3>() += body->com.cross(weight_L);
      }
    }
  }
  for (int i = static_cast<int>(model.joints.size()) - 1; i >= 0; --i) {
    const ModelJoint& joint = model.joints[i];
    const int child = joint.child_link;
    data.tau.segment(joint.v, joint.nv) = subspace_of(joint, data.X_PL[child]).transpose() * data.F_L[child];
    data.F_L[joint.parent_link] += force_to_parent(data.X_PL[child], data.F_L[child]);
  }
}

void gravity_torques(const Model& model, Data& data, const ConstVector& q, const Eigen::Vector3d& gravity) {
  data.zero_v.setZero();
  inverse_dynamics(model, data, q, data.zero_v, data.zero_v, gravity);
}

void mass_matrix(const Model& model, Data& data, const ConstVector& q) {
  assert(q.size() == model.nq);
  data.M.setZero();
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    data.composite[i].setZero();
    if (const auto& body = model.links[i].inertia) data.composite[i] = spatial_inertia(*body);
  }
  for (const ModelJoint& joint : model.joints) data.X_PL[joint.child_link] = parent_to_child(joint, q);
  for (int i = static_cast<int>(model.joints.size()) - 1; i >= 0; --i) {
    const ModelJoint& joint = model.joints[i];
    const int child = joint.child_link;
    data.composite[joint.parent_link] += inertia_to_parent(data.X_PL[child], data.composite[child]);
    if (joint.nv == 0) continue;
    const Subspace S = subspace_of(joint, data.X_PL[child]);
    Subspace F = data.composite[child] * S;
    const SmallMatrix own = S.transpose() * F;
    // Rounding leaves S^T F slightly asymmetric.
    data.M.block(joint.v, joint.v, joint.nv, joint.nv) = 0.5 * (own + own.transpose());
    for (const ModelJoint* at = &joint;;) {
      for (int k = 0; k < joint.nv; ++k) F.col(k) = force_to_parent(data.X_PL[at->child_link], F.col(k));
      const int up = model.links[at->parent_link].joint;
      if (up < 0) break;
      at = &model.joints[up];
      if (at->nv == 0) continue;
      data.M.block(at->v, joint.v, at->nv, joint.nv) =
          subspace_of(*at, data.X_PL[at->child_link]).transpose() * F;
      data.M.block(joint.v, at->v, joint.nv, at->nv) =
          data.M.block(at->v, joint.v, at->nv, joint.nv).transpose();
    }
  }
}

void drive_torques(const Model& model, const Data& data, Eigen::VectorXd& out) {
  out.setZero(static_cast<Eigen::Index>(model.joints.size()));
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (!joint.scalar()) continue;
    if (joint.mimics()) {
      out[joint.mimic_leader] += joint.mimic_multiplier * data.tau[joint.v];
    } else {
      out[static_cast<Eigen::Index>(i)] += data.tau[joint.v];
    }
  }
}

std::vector<Eigen::VectorXd> sample_configurations(const Model& model, int count) {
  // The additive recurrence by powers of the generalised golden ratio (Roberts 2018) spreads evenly
  // in any dimension.
  const double dimensions = std::max(1, model.nq);
  double ratio = 2.0;
  for (int i = 0; i < 40; ++i) ratio = std::pow(1.0 + ratio, 1.0 / (dimensions + 1.0));
  std::vector<Eigen::VectorXd> samples(static_cast<std::size_t>(count), model.neutral());
  for (int n = 1; n < count; ++n) {
    Eigen::VectorXd& q = samples[static_cast<std::size_t>(n)];
    for (const ModelJoint& joint : model.joints) {
      if (!joint.scalar() || joint.mimics()) continue;
      const double turn = n * std::pow(ratio, -(joint.q + 1.0));
      const double unit = turn - std::floor(turn);
      const bool bounded = std::isfinite(joint.lower) && std::isfinite(joint.upper);
      // A prismatic joint without limits stays at zero, because no range is meaningful; a revolute one
      // covers one turn.
      const double half = joint.type == JointType::prismatic ? 0.0 : std::numbers::pi;
      const double lower = bounded ? joint.lower : std::max(joint.lower, -half);
      const double upper = bounded ? joint.upper : std::min(joint.upper, half);
      q[joint.q] = lower + unit * (upper - lower);
    }
    model.apply_mimics(q);
  }
  return samples;
}

Eigen::VectorXd carried_inertia(const Model& model) {
  const auto joints = static_cast<Eigen::Index>(model.joints.size());
  Eigen::VectorXd carried = Eigen::VectorXd::Zero(joints);
  Data data(model);
  Eigen::MatrixXd moved =
      Eigen::MatrixXd::Zero(model.nv, joints);  // v of all joints per unit of the driven one
  for (Eigen::Index i = 0; i < joints; ++i) {
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(i)];
    if (!joint.scalar()) continue;
    moved(joint.v, joint.mimics() ? joint.mimic_leader : i) = joint.mimics() ? joint.mimic_multiplier : 1.0;
  }
  for (const Eigen::VectorXd& q : sample_configurations(model, kConfigurationSamples)) {
    mass_matrix(model, data, q);
    carried = carried.cwiseMax((moved.transpose() * data.M * moved).diagonal());
  }
  return carried;
}

}  // namespace doppel
