#pragma once
// A chain of joints, from one link to a link below it, as a flat list of numbers that kernels interpret.
// Positions are in rad or m.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "doppel/base/math/pose.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/robot/lanes/lane_kernels.h"

namespace doppel {

// A joint of the chain that moves. Its frame Z has the joint's axis as z.
struct ChainJoint {
  bool prismatic = false;
  int variable = 0;                   // its position is multiplier * u[variable] + offset
  double multiplier = 1, offset = 0;  // those of a mimic joint
  Pose X_PZ = Pose::Identity();       // at position 0, in the Z of the joint before it, or in the base link
};

struct DOPPEL_API Chain {
  int base_link = -1, tip_link = -1;  // indices into Model::links
  std::vector<ChainJoint> joints;     // base first; no fixed ones
  // The joints of the model that can be set: those of the chain, and the leaders of its mimic joints.
  std::vector<int> variables;
  Eigen::VectorXd lower, upper;  // [variables] limits, also those of mimic joints; infinite: none
  Pose X_ZT = Pose::Identity();  // the tip link in the Z of the last joint
  double length = 0;   // m: the tip is never farther from the first Z's origin; without limits, 1 m counts
  bool direct = true;  // joint i is variable i itself: no mimic joints
  std::vector<bool> turns;  // [variables] a whole turn of the variable leaves every link where it is

  [[nodiscard]] int size() const { return static_cast<int>(variables.size()); }

  // The variables of a configuration q [nq], and the way back: q of the variables and of all joints that
  // mimic them.
  [[nodiscard]] Eigen::VectorXd variables_of(const Model& model, const Eigen::VectorXd& q) const;
  void apply(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& u, Eigen::VectorXd& q) const;
};

// Throws std::invalid_argument with the reason, as a sentence without a full stop: the tip is not below the
// base, no joint between them moves, one has several degrees of freedom, there are more than
// kMaxChainVariables or, with mimic joints, kMaxChainJoints, or the limits of a mimic joint and of its leader
// exclude each other.
DOPPEL_API Chain make_chain(const Model& model, int base_link, int tip_link);

// For each link of the model, the variables of the chain that move it against the root, a bit for each. Two
// links move against each other if their bits differ.
DOPPEL_API std::vector<std::uint32_t> moving_variables(const Model& model, const Chain& chain);

// X_BT, the tip in the base link, at u [variables]: the forward kinematics of the chain alone, in a
// fraction of the time of the whole model's. Does not allocate.
DOPPEL_API Pose tip_pose(const Chain& chain, const Eigen::Ref<const Eigen::VectorXd>& u);

// Walks from the base to the tip at u [variables]: visit(i, z_B, p_B) gets the axis of joint i and a point
// of it, m. Returns X_BT.
template <class Vector, class Visit>
Pose walk(const Chain& chain, const Vector& u, Visit&& visit) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const ChainJoint& joint = chain.joints[i];
    p += R * joint.X_PZ.translation();
    R = (R * joint.X_PZ.linear()).eval();
    visit(i, Eigen::Vector3d(R.col(2)), p);
    const double position = joint.multiplier * u[joint.variable] + joint.offset;
    if (joint.prismatic) {
      p += position * R.col(2);
      continue;
    }
    const double c = std::cos(position), s = std::sin(position);
    const Eigen::Vector3d x = R.col(0), y = R.col(1);
    R.col(0) = c * x + s * y;
    R.col(1) = c * y - s * x;
  }
  Pose X_BT = Pose::Identity();
  X_BT.translation() = p + R * chain.X_ZT.translation();
  X_BT.linear() = R * chain.X_ZT.linear();
  return X_BT;
}

}  // namespace doppel
