#include "doppel/twin/arms/detail/arm_messages.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cstring>

#include "doppel/base/core/names.h"
#include "doppel/robot/collision/size_limits.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel {
namespace {

using moveit_msgs::msg::MoveItErrorCodes;

}  // namespace

moveit_msgs::msg::MoveItErrorCodes error_code(std::int32_t code, const std::string& message) {
  MoveItErrorCodes out;
  out.val = code;
  out.message = message;
  if (!message.empty()) out.source = "doppel";
  return out;
}

Pose checked_pose(const geometry_msgs::msg::Pose& pose) {
  const std::optional<Pose> X = from_msg(pose);
  if (!X || X->translation().cwiseAbs().maxCoeff() > kMaxDistance) {
    throw MoveItError{MoveItErrorCodes::INVALID_GOAL_CONSTRAINTS,
                      "the pose has a number that is not finite, a position beyond 10 km, or a quaternion of "
                      "length 0"};
  }
  return *X;
}

Eigen::VectorXd with_state(const ArmSnapshot& snapshot, const moveit_msgs::msg::RobotState& state) {
  const Model& model = snapshot.model();
  const auto refuse = [](std::string message) {
    throw MoveItError{MoveItErrorCodes::INVALID_ROBOT_STATE, std::move(message)};
  };
  const sensor_msgs::msg::JointState& joints = state.joint_state;
  if (joints.name.size() != joints.position.size())
    refuse(
        fmt::format("the state has {} names and {} positions", joints.name.size(), joints.position.size()));
  if (!state.attached_collision_objects.empty())
    refuse("objects are attached in the twin, not in the request's state: see doppel man reach.md");
  Eigen::VectorXd q = snapshot.q;
  for (std::size_t i = 0; i < joints.name.size(); ++i) {
    const int joint = model.find_joint(joints.name[i]);
    if (joint < 0 || !model.joints[static_cast<std::size_t>(joint)].scalar()) {
      refuse(fmt::format("the robot has no joint '{}'{}", joints.name[i],
                         did_you_mean(joints.name[i], model.scalar_joint_names())));
    }
    if (!std::isfinite(joints.position[i]))
      refuse(fmt::format("the position of '{}' is not finite", joints.name[i]));
    q[model.joints[static_cast<std::size_t>(joint)].q] = joints.position[i];
  }
  model.apply_mimics(q);
  return q;
}

moveit_msgs::msg::RobotState state_message(const ArmSnapshot& snapshot, const Eigen::VectorXd& q) {
  moveit_msgs::msg::RobotState out;
  const Model& model = snapshot.model();
  out.joint_state.header.frame_id = model.links[static_cast<std::size_t>(snapshot.robot->base_link)].name;
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar()) continue;
    out.joint_state.name.push_back(joint.name);
    out.joint_state.position.push_back(q[joint.q]);
  }
  return out;
}

Pose pose_in_root(const ArmSnapshot& snapshot, const Eigen::VectorXd& q, const std::string& frame,
                  const Pose& X_FT) {
  const std::optional<Pose> X_RF = find_frame(snapshot, q, frame);
  if (!X_RF) {
    throw MoveItError{MoveItErrorCodes::FRAME_TRANSFORM_FAILURE,
                      fmt::format("there is no frame '{}'{}", frame, nearest_frame(snapshot, frame))};
  }
  return *X_RF * X_FT;
}

doppel_msgs::msg::IkBranch branch_message(const ReachBranch& branch, const Pose& X_RB, const Pose& X_RF) {
  doppel_msgs::msg::IkBranch out;
  const IkSolution& solution = branch.solution;
  out.positions.assign(solution.u.begin(), solution.u.end());
  out.pose = to_pose_msg(X_RF.inverse(Eigen::Isometry) * X_RB * solution.X_BT);
  out.position_error = solution.position_error;
  out.rotation_error = solution.rotation_error;
  out.free_rotation = solution.free_rotation;
  out.distance = solution.distance;
  out.clearance = branch.clearance;
  if (!branch.nearest_pair.a.empty()) out.nearest = {branch.nearest_pair.a, branch.nearest_pair.b};
  out.depth = branch.nearest_pair.depth;
  out.manipulability = branch.manipulability;
  out.limit_distance = branch.limit_distance;
  return out;
}

sensor_msgs::msg::PointCloud2 cloud_message(const ReachMap& map, const std::string& frame, Time stamp) {
  namespace msg = sensor_msgs::msg;
  msg::PointCloud2 out;
  out.header.frame_id = frame;
  out.header.stamp = to_time_msg(stamp);
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", "share", "manipulability", "limit_distance"}) {
    out.fields.push_back({name, offset, msg::PointField::FLOAT32, 1});
    offset += 4;
  }
  out.point_step = offset;
  out.height = 1;
  out.is_dense = true;
  for (int z = 0; z < map.nz; ++z) {
    for (int y = 0; y < map.ny; ++y) {
      for (int x = 0; x < map.nx; ++x) {
        const ReachCell& cell = map.at(x, y, z);
        if (!cell.in_reach) continue;
        const Eigen::Vector3f p = map.center(x, y, z).cast<float>();
        const float values[6] = {p.x(), p.y(), p.z(), cell.share, cell.manipulability, cell.limit_distance};
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(values);
        out.data.insert(out.data.end(), bytes, bytes + sizeof values);
        ++out.width;
      }
    }
  }
  out.row_step = out.width * out.point_step;
  return out;
}

}  // namespace doppel
