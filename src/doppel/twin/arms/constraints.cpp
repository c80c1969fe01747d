// Constraints of a state, as moveit_core's kinematic_constraint.cpp (jazzy) reads them.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/sensors/rigs/pose_messages.h"
#include "doppel/twin/arms/detail/arm_messages.h"

namespace doppel {
namespace {

using moveit_msgs::msg::MoveItErrorCodes;
using Result = moveit_msgs::msg::ConstraintEvalResult;

[[noreturn]] void refuse_constraint(std::int32_t code, std::string message) {
  throw MoveItError{code, std::move(message)};
}

class Evaluator {
 public:
  Evaluator(const ArmSnapshot& snapshot, const Eigen::VectorXd& q)
      : snapshot_(snapshot), q_(q), data_(snapshot.model()) {
    forward_kinematics(snapshot.model(), data_, q);
  }

  // The difference of a joint that turns without limits is taken over whole turns.
  [[nodiscard]] Result joint(const moveit_msgs::msg::JointConstraint& constraint) const {
    const Model& model = snapshot_.model();
    const int index = model.find_joint(constraint.joint_name);
    if (index < 0 || !model.joints[static_cast<std::size_t>(index)].scalar()) {
      refuse_constraint(MoveItErrorCodes::INVALID_GOAL_CONSTRAINTS,
                        fmt::format("the robot has no joint '{}'{}", constraint.joint_name,
                                    did_you_mean(constraint.joint_name, model.scalar_joint_names())));
    }
    const ModelJoint& found = model.joints[static_cast<std::size_t>(index)];
    double difference = q_[found.q] - constraint.position;
    if (found.type == JointType::continuous) difference = std::remainder(difference, 2 * M_PI);
    Result out;
    out.result = difference <= constraint.tolerance_above && difference >= -constraint.tolerance_below;
    out.distance = std::abs(difference);
    return out;
  }

  [[nodiscard]] Result position(const moveit_msgs::msg::PositionConstraint& constraint) const {
    const Pose& X_RL = link(constraint.link_name);
    const auto& offset = constraint.target_point_offset;
    const Eigen::Vector3d p_R = X_RL * Eigen::Vector3d(offset.x, offset.y, offset.z);
    const auto& region = constraint.constraint_region;
    if (!region.meshes.empty())
      refuse_constraint(MoveItErrorCodes::INVALID_GOAL_CONSTRAINTS,
                        "regions of position constraints are primitives here, not meshes");
    if (region.primitives.size() != region.primitive_poses.size() || region.primitives.empty())
      refuse_constraint(
          MoveItErrorCodes::INVALID_GOAL_CONSTRAINTS,
          "a position constraint has no region, or another number of shapes than of their poses");
    Result out;
    out.distance = kInfinity;
    for (std::size_t i = 0; i < region.primitives.size(); ++i) {
      const Pose X_RS =
          pose_in_root(snapshot_, q_, constraint.header.frame_id, checked_pose(region.primitive_poses[i]));
      out.result = out.result || inside(region.primitives[i], X_RS.inverse(Eigen::Isometry) * p_R);
      out.distance = std::min(out.distance, (p_R - X_RS.translation()).norm());
    }
    return out;
  }

  [[nodiscard]] Result orientation(const moveit_msgs::msg::OrientationConstraint& constraint) const {
    geometry_msgs::msg::Pose pose;
    pose.orientation = constraint.orientation;
    const Eigen::Matrix3d R_RF =
        pose_in_root(snapshot_, q_, constraint.header.frame_id, Pose::Identity()).linear();
    const Eigen::Matrix3d R_FD = checked_pose(pose).linear();
    // The rotation that is left, in the axes of the reference frame.
    const Eigen::Matrix3d left = R_RF.transpose() * link(constraint.link_name).linear() * R_FD.transpose();
    Eigen::Vector3d error;
    if (constraint.parameterization == moveit_msgs::msg::OrientationConstraint::ROTATION_VECTOR) {
      const Eigen::AngleAxisd turn(left);
      error = turn.angle() * turn.axis();
    } else {
      error = left.eulerAngles(0, 1, 2);
      if (std::abs(error[0]) > M_PI / 2)
        error = {error[0] - std::copysign(M_PI, error[0]), M_PI - error[1],
                 error[2] - std::copysign(M_PI, error[2])};
      for (double& angle : error) angle = std::remainder(angle, 2 * M_PI);
    }
    Result out;
    out.distance = error.cwiseAbs().sum();
    out.result = std::abs(error[0]) <= constraint.absolute_x_axis_tolerance + kRounding &&
                 std::abs(error[1]) <= constraint.absolute_y_axis_tolerance + kRounding &&
                 std::abs(error[2]) <= constraint.absolute_z_axis_tolerance + kRounding;
    return out;
  }

 private:
  static constexpr double kRounding = 1e-9;

  [[nodiscard]] const Pose& link(const std::string& name) const {
    const Model& model = snapshot_.model();
    const int index = model.find_link(name);
    if (index < 0) {
      refuse_constraint(
          MoveItErrorCodes::INVALID_LINK_NAME,
          fmt::format("the robot has no link '{}'{}", name, did_you_mean(name, model.link_names())));
    }
    return data_.X_WL[static_cast<std::size_t>(index)];
  }

  static bool inside(const shape_msgs::msg::SolidPrimitive& shape, const Eigen::Vector3d& p) {
    using Kind = shape_msgs::msg::SolidPrimitive;
    const auto& d = shape.dimensions;
    if (shape.type == Kind::BOX && d.size() == 3)
      return std::abs(p.x()) <= d[0] / 2 && std::abs(p.y()) <= d[1] / 2 && std::abs(p.z()) <= d[2] / 2;
    if (shape.type == Kind::SPHERE && d.size() == 1) return p.norm() <= d[0];
    if (shape.type == Kind::CYLINDER && d.size() == 2)
      return std::abs(p.z()) <= d[0] / 2 && p.head<2>().norm() <= d[1];
    refuse_constraint(
        MoveItErrorCodes::INVALID_GOAL_CONSTRAINTS,
        "regions of position constraints are boxes, spheres and cylinders, with their dimensions");
  }

  const ArmSnapshot& snapshot_;
  const Eigen::VectorXd& q_;
  Data data_;
};

}  // namespace

std::vector<Result> evaluate(const ArmSnapshot& snapshot, const moveit_msgs::msg::Constraints& constraints,
                             const Eigen::VectorXd& q) {
  if (!constraints.visibility_constraints.empty())
    refuse_constraint(MoveItErrorCodes::INVALID_GOAL_CONSTRAINTS, "visibility constraints are not supported");
  const Evaluator evaluator(snapshot, q);
  std::vector<Result> out;
  for (const auto& constraint : constraints.joint_constraints) out.push_back(evaluator.joint(constraint));
  for (const auto& constraint : constraints.position_constraints)
    out.push_back(evaluator.position(constraint));
  for (const auto& constraint : constraints.orientation_constraints)
    out.push_back(evaluator.orientation(constraint));
  return out;
}

}  // namespace doppel
