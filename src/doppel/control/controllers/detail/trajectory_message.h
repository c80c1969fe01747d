#pragma once
// Received trajectory_msgs/msg/JointTrajectory messages: checked by joint_trajectory_controller's rules, then
// reordered to the controller's joints. Between steps.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/control/controllers/detail/trajectory.h"
#include "doppel/ros/messages/trajectory_msgs.h"

namespace doppel::jtc {

struct MessageRules {
  std::vector<std::string> joints;  // of the controller, in its order
  std::vector<std::string>
      ignored;  // further names that a message may have, whose values are not used (mimics)
  bool allow_partial_joints = false;
  bool allow_integration = false;
  bool allow_nonzero_velocity_at_end = false;
  bool effort_commanded = false;
};

// Refuses with one sentence for the sender, with the joint, the point (counted from 1) and the fix.
Status check_message(const trajectory_msgs::msg::JointTrajectory& message, const MessageRules& rules,
                     Time now);

// Joints that an accepted message names more than once; their last values are used.
std::vector<std::string> repeated_joints(const trajectory_msgs::msg::JointTrajectory& message);

// Precondition: check_message() is ok. Joints that the message leaves out stay at `hold`, without velocity.
std::unique_ptr<Trajectory> make_trajectory(const trajectory_msgs::msg::JointTrajectory& message,
                                            const MessageRules& rules, std::span<const double> hold);

}  // namespace doppel::jtc
