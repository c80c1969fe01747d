#include "doppel/scenario/resolve/described_arms.h"

#include <algorithm>
#include <utility>

#include "doppel/scenario/resolve/srdf_search.h"

namespace doppel {

std::vector<ArmGroup> described_arms(const Model& model, const RobotDescription& robot, const Target* target,
                                     PackageResolver& resolver, const std::vector<JointGroup>& controllers,
                                     Diagnostics& notes) {
  std::vector<ArmGroup> out;
  if (target != nullptr) {
    // The first file that has an arm decides: others are those of other configurations of the same robot.
    for (const FoundSrdf& found : find_srdf(robot, *target, resolver, notes)) {
      for (ArmGroup& arm : find_arms(model, found.srdf, notes)) out.push_back(std::move(arm));
      if (!out.empty()) break;
    }
  }
  for (ArmGroup& arm : find_arms(model, find_planning_groups(model, controllers), notes)) {
    const bool is_there = std::any_of(out.begin(), out.end(), [&arm](const ArmGroup& other) {
      return other.name == arm.name ||
             (other.chain.base_link == arm.chain.base_link && other.chain.tip_link == arm.chain.tip_link);
    });
    if (!is_there) out.push_back(std::move(arm));
  }
  return out;
}

}  // namespace doppel
