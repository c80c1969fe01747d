#pragma once
// A first guess at what MoveIt plans for: arms as chains, grippers as sets of joints with the link they sit
// on. The controllers say it where there are any, for people put there together what moves together; else
// the tree does.

#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/kinematics/model.h"
#include "doppel/target/controllers_file.h"

namespace doppel {

struct JointGroup {
  std::string name, type;  // of the controller: "joint_trajectory_controller/JointTrajectoryController"
  std::vector<std::string> joints;  // that it names; a broadcaster's are empty
};

// Of every controller that a file declares with its type, in its order.
DOPPEL_API std::vector<JointGroup> joint_groups(const ControllersFile& file);

struct PlanningGroup {
  std::string name;  // "arm", "left_gripper"
  bool gripper = false;
  std::vector<int> joints;            // of the model, parents first; driven ones, and of a gripper its mimics
  int base_link = -1, tip_link = -1;  // of an arm that is a chain
  int parent_link = -1;               // of a gripper: the link it sits on
  int parent_group = -1;              // of a gripper: the arm it belongs to; -1: none
};

DOPPEL_API std::vector<PlanningGroup> find_planning_groups(const Model& model,
                                                           const std::vector<JointGroup>& controllers);

}  // namespace doppel
