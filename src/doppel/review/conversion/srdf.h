#pragma once
// An initial SRDF for MoveIt: groups, end effectors, the virtual joint, a home state, and the pairs of links
// that need no collision checking. Source: wiki.ros.org/srdf, moveit_setup_assistant.

#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/robot/semantics/planning_groups.h"
#include "doppel/robot/semantics/self_collision.h"

namespace doppel {

DOPPEL_API std::string to_srdf(const Model& model, const std::vector<PlanningGroup>& groups,
                               const std::vector<DisabledPair>& disabled);

}  // namespace doppel
