#pragma once
// Estimated planning groups for MoveIt: arms as chains, grippers as sets of joints with their parent link.
// They are derived from the joints of each controller, because users list joints that move together in one
// controller, or from the tree if there are no controllers.

#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// The joints that move together.
struct JointGroup {
  std::string name, type;  // of the controller: "joint_trajectory_controller/JointTrajectoryController"
  std::vector<std::string> joints;  // in its YAML; empty for a broadcaster
};

struct PlanningGroup {
  std::string name;  // "arm", "left_gripper"
  bool gripper = false;
  std::vector<int> joints;            // of the model, parents first; driven ones, and of a gripper its mimics
  int base_link = -1, tip_link = -1;  // of an arm that is a chain
  int parent_link = -1;               // of a gripper: the link to which it is attached
  int parent_group = -1;              // of a gripper: its arm; -1: none
};

DOPPEL_API std::vector<PlanningGroup> find_planning_groups(const Model& model,
                                                           const std::vector<JointGroup>& controllers);

}  // namespace doppel
