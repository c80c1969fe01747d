#include "doppel/robot/lanes/chain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace doppel {
namespace {

constexpr double kFreeSlide = 1;  // m: what of a sliding joint without limits is looked at

// Adds a joint of the model that is set, with its limits; its index among the variables.
int add_variable(Chain& chain, const Model& model, int joint) {
  const auto found = std::find(chain.variables.begin(), chain.variables.end(), joint);
  if (found != chain.variables.end()) return static_cast<int>(found - chain.variables.begin());
  const ModelJoint& source = model.joints[static_cast<std::size_t>(joint)];
  if (!source.scalar()) {
    throw std::invalid_argument(fmt::format("joint '{}' has several degrees of freedom", source.name));
  }
  if (chain.size() == kMaxChainVariables) {
    throw std::invalid_argument(fmt::format("it has more than {} joints that move", kMaxChainVariables));
  }
  chain.variables.push_back(joint);
  chain.turns.push_back(true);
  const auto last = static_cast<Eigen::Index>(chain.variables.size()) - 1;
  chain.lower.conservativeResize(last + 1);
  chain.upper.conservativeResize(last + 1);
  chain.lower[last] = source.lower;
  chain.upper[last] = source.upper;
  return static_cast<int>(last);
}

// A mimic joint may stop before its leader does.
void narrow_limits(Chain& chain, const ModelJoint& source, const ChainJoint& joint) {
  if (!source.mimics() || joint.multiplier == 0) return;
  double low = (source.lower - joint.offset) / joint.multiplier;
  double high = (source.upper - joint.offset) / joint.multiplier;
  if (low > high) std::swap(low, high);
  double& lower = chain.lower[joint.variable];
  double& upper = chain.upper[joint.variable];
  lower = std::max(lower, low);
  upper = std::min(upper, high);
  if (lower > upper) {
    throw std::invalid_argument(
        fmt::format("the limits of joint '{}' exclude those of the joint that it mimics", source.name));
  }
}

}  // namespace

Chain make_chain(const Model& model, int base_link, int tip_link) {
  Chain chain;
  chain.base_link = base_link;
  chain.tip_link = tip_link;
  Pose X_PL = Pose::Identity();  // the current link in the Z of the last joint that moves, or in the base
  const auto path = joints_between(model, base_link, tip_link);
  if (!path) {
    throw std::invalid_argument(fmt::format("link '{}' is not below link '{}'",
                                            model.links[static_cast<std::size_t>(tip_link)].name,
                                            model.links[static_cast<std::size_t>(base_link)].name));
  }
  for (const int index : *path) {
    const ModelJoint& source = model.joints[static_cast<std::size_t>(index)];
    const Pose X_PJ = X_PL * source.X_PJ;
    if (source.type == JointType::fixed) {
      X_PL = X_PJ;
      continue;
    }
    if (chain.joints.size() == kMaxChainJoints)
      throw std::invalid_argument(fmt::format("more than {} joints between its ends move", kMaxChainJoints));
    ChainJoint joint;
    joint.prismatic = source.type == JointType::prismatic;
    joint.variable = add_variable(chain, model, source.mimics() ? source.mimic_leader : index);
    joint.multiplier = source.mimics() ? source.mimic_multiplier : 1;
    joint.offset = source.mimics() ? source.mimic_offset : 0;
    narrow_limits(chain, source, joint);
    const auto variable = static_cast<std::size_t>(joint.variable);
    const bool whole = joint.multiplier == std::round(joint.multiplier);
    chain.turns[variable] = chain.turns[variable] && !joint.prismatic && whole;
    const Eigen::Matrix3d R_JZ = rotation_from_z(source.axis);
    joint.X_PZ = X_PJ;
    joint.X_PZ.linear() = X_PJ.linear() * R_JZ;
    chain.direct = chain.direct && !source.mimics();
    if (!chain.joints.empty()) chain.length += joint.X_PZ.translation().norm();
    if (joint.prismatic) {
      const bool finite = std::isfinite(source.lower) && std::isfinite(source.upper);
      chain.length += finite ? std::max(std::abs(source.lower), std::abs(source.upper)) : kFreeSlide;
    }
    chain.joints.push_back(joint);
    X_PL.setIdentity();
    X_PL.linear() = R_JZ.transpose();
  }
  if (chain.joints.empty()) throw std::invalid_argument("no joint between its base and its tip moves");
  chain.X_ZT = X_PL;
  chain.length += X_PL.translation().norm();
  return chain;
}

Eigen::VectorXd Chain::variables_of(const Model& model, const Eigen::VectorXd& q) const {
  Eigen::VectorXd u(size());
  for (int i = 0; i < size(); ++i)
    u[i] = q[model.joints[static_cast<std::size_t>(variables[static_cast<std::size_t>(i)])].q];
  return u;
}

void Chain::apply(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& u, Eigen::VectorXd& q) const {
  for (int i = 0; i < size(); ++i)
    q[model.joints[static_cast<std::size_t>(variables[static_cast<std::size_t>(i)])].q] = u[i];
  model.apply_mimics(q);
}

std::vector<std::uint32_t> moving_variables(const Model& model, const Chain& chain) {
  std::vector<std::uint32_t> out(model.links.size(), 0);
  for (const ModelJoint& joint : model.joints) {
    const auto index = static_cast<int>(&joint - model.joints.data());
    std::uint32_t bits = out[static_cast<std::size_t>(joint.parent_link)];
    for (int v = 0; v < chain.size(); ++v) {
      const int variable = chain.variables[static_cast<std::size_t>(v)];
      if (variable == index || variable == joint.mimic_leader) bits |= 1U << v;
    }
    out[static_cast<std::size_t>(joint.child_link)] = bits;
  }
  return out;
}

Pose tip_pose(const Chain& chain, const Eigen::Ref<const Eigen::VectorXd>& u) {
  return walk(chain, u, [](std::size_t, const Eigen::Vector3d&, const Eigen::Vector3d&) {});
}

}  // namespace doppel
