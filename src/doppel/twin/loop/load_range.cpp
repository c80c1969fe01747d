#include "doppel/twin/loop/load_range.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "doppel/base/math/mass_properties.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {
namespace {

constexpr double kLever = 4;  // radii of gyration: the corner of a box is at 2.1 of its own

Eigen::VectorXd position_of(const Instance& instance) {
  return Eigen::Map<const Eigen::VectorXd>(instance.q().data(), instance.model().nq);
}

}  // namespace

double max_speed(const ModelJoint& joint) {
  if (!std::isfinite(joint.velocity)) return kMaxEntitySpeed;
  return std::clamp(kMaxLimitFactor * joint.velocity, 1.0, std::max(kMaxEntitySpeed, joint.velocity));
}

double max_effort(const Instance& instance, int joint) {
  const Model& model = instance.model();
  const ModelJoint& of = model.joints[static_cast<std::size_t>(joint)];
  Data data(model);
  mass_matrix(model, data, position_of(instance));
  const double by_inertia = kMaxLoadAcceleration * data.M(of.v, of.v);
  return std::isfinite(of.effort) ? std::max(by_inertia, kMaxLimitFactor * of.effort) : by_inertia;
}

WrenchRange max_wrench(const Instance& instance) {
  const Model& model = instance.model();
  Data data(model);
  forward_kinematics(model, data, position_of(instance));
  MassProperties whole;
  for (std::size_t link = 0; link < model.links.size(); ++link) {
    if (model.links[link].inertia)
      whole = combined(whole, transformed(*model.links[link].inertia, data.X_WL[link]));
  }
  if (!(whole.mass > 0)) return {};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(whole.I, Eigen::EigenvaluesOnly);
  const double gyration = std::sqrt(std::max(principal.eigenvalues().maxCoeff(), 0.0) / whole.mass);
  const double force = kMaxLoadAcceleration * whole.mass;
  return {force, force * kLever * gyration};
}

Status check_joint_state(const std::string& name, const ModelJoint& joint, double position, double velocity) {
  if (!std::isfinite(position) || !std::isfinite(velocity))
    return Status::refused(fmt::format("the state of '{}' is not a finite number", name));
  if (position < joint.lower || position > joint.upper) {
    return Status::refused(
        fmt::format("{} is outside the limits of '{}', [{}, {}]", position, name, joint.lower, joint.upper));
  }
  const bool slides = joint.type == JointType::prismatic;
  if (const double furthest = slides ? kMaxTravel : kMaxTurn; std::abs(position) > furthest) {
    return Status::refused(fmt::format("the position of '{}' is {:g} {}; it can be set from {:g} to {:g}",
                                       name, position, slides ? "m" : "rad", -furthest, furthest));
  }
  if (const double fastest = max_speed(joint); std::abs(velocity) > fastest) {
    return Status::refused(fmt::format("the velocity of '{}' is {:g} {}; it can be set from {:g} to {:g}",
                                       name, velocity, slides ? "m/s" : "rad/s", -fastest, fastest));
  }
  return {};
}

}  // namespace doppel
