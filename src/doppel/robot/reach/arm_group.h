#pragma once
// The arms of a robot: groups of joints (robot/semantics) that are chains with a tip.

#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/srdf/srdf.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/robot/lanes/chain.h"
#include "doppel/robot/semantics/planning_groups.h"

namespace doppel {

struct ArmGroup {
  std::string name;  // "arm", "left_arm"
  Chain chain;
};

// Each group that is no chain, or has joints that a chain cannot have, gives a note instead of an arm.
DOPPEL_API std::vector<ArmGroup> find_arms(const Model& model, const std::vector<PlanningGroup>& groups,
                                           Diagnostics& notes);

// The groups of a semantic description that are chains, under their names.
DOPPEL_API std::vector<ArmGroup> find_arms(const Model& model, const SrdfDescription& srdf,
                                           Diagnostics& notes);

// The group of a name; for "" the first of those with the most joints. Throws InputError: there is none; "did
// you mean".
DOPPEL_API const ArmGroup& choose_arm(const std::vector<ArmGroup>& arms, const std::string& name);

}  // namespace doppel
