#pragma once
// The semantic description that follows from a model: groups, end effectors, the virtual joint, a home state,
// passive joints, and the pairs of links that need no collision checking.

#include <vector>

#include "doppel/description/srdf/srdf.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/robot/semantics/planning_groups.h"
#include "doppel/robot/semantics/self_collision.h"

namespace doppel {

DOPPEL_API SrdfDescription derived_srdf(const Model& model, const std::vector<PlanningGroup>& groups,
                                        const std::vector<DisabledPair>& disabled);

}  // namespace doppel
