#include "doppel/review/identification/inertia_operation.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "doppel/base/math/pose.h"

namespace doppel {
namespace {

constexpr double kSameBody = 1e-4;  // relative

// Six digits: fewer would make a thin body impossible.
double six_digits(double value) {
  return std::stod(fmt::format("{:.6g}", value));
}

bool is_same(const MassProperties& a, const MassProperties& b) {
  return std::abs(a.mass - b.mass) < kSameBody * b.mass &&
         (a.com - b.com).norm() < kSameBody * (b.com.norm() + 0.01) &&
         (a.I - b.I).norm() < kSameBody * b.I.norm();
}

SetInertia set_inertia(const Link& link, const MassProperties& body) {
  SetInertia out;
  out.link = link.name;
  out.mass = six_digits(body.mass);
  out.com = body.com.unaryExpr(&six_digits);
  // In the axes of <inertial>'s origin.
  const Eigen::Matrix3d R =
      link.inertial ? rotation_from_rpy(link.inertial->origin.rpy) : Eigen::Matrix3d::Identity().eval();
  const Eigen::Matrix3d I = R.transpose() * body.I * R;
  const char* const names[3][3] = {{"ixx", "ixy", "ixz"}, {"", "iyy", "iyz"}, {"", "", "izz"}};
  for (int i = 0; i < 3; ++i) {
    for (int k = i; k < 3; ++k) out.components[names[i][k]] = six_digits(I(i, k));
  }
  return out;
}

}  // namespace

void remove_payload(FittedLink& link, const Payload& payload, const ModelLink& described) {
  const MassProperties weight{-payload.mass, payload.p_LoC_L, Eigen::Matrix3d::Zero()};
  if (described.inertia) link.described = *described.inertia;
  if (link.fitted.mass <= payload.mass) {
    link.fitted = link.described;
    return;
  }
  const MassProperties rest = combined(link.fitted, weight);
  const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(rest.I).eigenvalues();
  const bool can_exist = moments[0] > 0 && moments[0] + moments[1] > moments[2];
  link.fitted = can_exist ? rest : link.described;
}

std::vector<Operation> dynamics_operations(const RobotDescription& robot, const Model& model,
                                           const InverseModel& fit) {
  std::vector<Operation> out;
  double before = 0, after = 0;
  for (const TorqueErrors& one : fit.errors) {
    before = std::max(before, one.described / std::max(one.effort, 1e-12));
    after = std::max(after, one.physical / std::max(one.effort, 1e-12));
  }
  const std::string evidence =
      fmt::format("held-out efforts: largest error {:.2g} % of a joint's effort, described {:.2g} %",
                  100 * after, 100 * before);
  for (const FittedLink& one : fit.links) {
    const std::string& name = model.links[static_cast<std::size_t>(one.link)].name;
    const auto found = std::ranges::find(robot.links, name, &Link::name);
    if (found == robot.links.end() || is_same(one.fitted, one.described)) continue;
    Operation operation;
    operation.action = set_inertia(*found, one.fitted);
    operation.why = "identified from efforts; only together with the other links of this recording";
    operation.evidence = {evidence};
    out.push_back(std::move(operation));
  }
  for (const FittedDrive& one : fit.drives) {
    SetServo servo;
    servo.joint = model.joints[static_cast<std::size_t>(one.joint)].name;
    if (one.knows_armature) servo.armature = six_digits(one.fitted.armature);
    if (one.knows_viscous) servo.viscous = six_digits(one.fitted.viscous);
    if (one.knows_friction) servo.friction = six_digits(one.fitted.friction);
    if (!servo.armature && !servo.viscous && !servo.friction) continue;
    Operation operation;
    operation.action = std::move(servo);
    operation.why = "identified from efforts";
    operation.evidence = {evidence};
    out.push_back(std::move(operation));
  }
  return out;
}

}  // namespace doppel
