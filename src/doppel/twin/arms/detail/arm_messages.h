#pragma once
// Messages from and to the computations of robot/reach.

#include <string>
#include <vector>

#include "doppel/robot/reach/reach_map.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/moveit_msgs.h"
#include "doppel/twin/arms/arm_snapshot.h"

namespace doppel {

// A code of MoveItErrorCodes with the reason; thrown by what cannot be answered.
struct MoveItError {
  std::int32_t code = 0;
  std::string message;
};
moveit_msgs::msg::MoveItErrorCodes error_code(std::int32_t code, const std::string& message = "");

// Throws MoveItError: numbers that are not finite, beyond kMaxDistance, or a rotation that is none.
Pose checked_pose(const geometry_msgs::msg::Pose& pose);

// q with the positions of a state, as a difference to what there is. Throws MoveItError: unknown joints,
// another number of positions than names, attached objects.
Eigen::VectorXd with_state(const ArmSnapshot& snapshot, const moveit_msgs::msg::RobotState& state);
// All scalar joints of the model.
moveit_msgs::msg::RobotState state_message(const ArmSnapshot& snapshot, const Eigen::VectorXd& q);

// A pose of a header's frame in the robot's root link. Throws MoveItError: there is no such frame.
Pose pose_in_root(const ArmSnapshot& snapshot, const Eigen::VectorXd& q, const std::string& frame,
                  const Pose& X_FT);

// How far a configuration is from each constraint, in the order joints, positions, orientations. Throws
// MoveItError: it names what there is not, or has visibility constraints.
std::vector<moveit_msgs::msg::ConstraintEvalResult> evaluate(const ArmSnapshot& snapshot,
                                                             const moveit_msgs::msg::Constraints& constraints,
                                                             const Eigen::VectorXd& q);

// `X_RF`: the frame of the request, in the root link.
doppel_msgs::msg::IkBranch branch_message(const ReachBranch& branch, const Pose& X_RB, const Pose& X_RF);
sensor_msgs::msg::PointCloud2 cloud_message(const ReachMap& map, const std::string& frame, Time stamp);

}  // namespace doppel
