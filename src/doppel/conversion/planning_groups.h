#pragma once
// A first guess at what MoveIt plans for: arms as chains, grippers as sets of joints with the link they sit
// on. The controllers say it where there are any, for people put there together what moves together; else
// the tree does.

#include <string>
#include <vector>

#include "doppel/control/parameter_file.h"
#include "doppel/kinematics/model.h"

namespace doppel {

// The joints of one controller.
struct JointGroup {
  std::string name;  // of the controller
  std::vector<std::string> joints;
};

// Of every controller that a file declares and that names joints; broadcasters move nothing.
std::vector<JointGroup> joint_groups(const ParameterFile& controllers);

struct PlanningGroup {
  std::string name;  // "arm", "left_gripper"
  bool gripper = false;
  std::vector<int> joints;            // of the model, parents first; driven ones, and of a gripper its mimics
  int base_link = -1, tip_link = -1;  // of an arm that is a chain
  int parent_link = -1;               // of a gripper: the link it sits on
  int parent_group = -1;              // of a gripper: the arm it belongs to; -1: none
};

std::vector<PlanningGroup> find_planning_groups(const Model& model,
                                                const std::vector<JointGroup>& controllers);

}  // namespace doppel
