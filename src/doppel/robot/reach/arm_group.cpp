#include "doppel/robot/reach/arm_group.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "doppel/base/core/names.h"
#include "doppel/robot/semantics/srdf_groups.h"

namespace doppel {

namespace {

void add_arm(const Model& model, const std::string& name, int base, int tip, std::vector<ArmGroup>& out,
             Diagnostics& notes) {
  try {
    out.push_back({name, make_chain(model, base, tip)});
  } catch (const std::invalid_argument& reason) {
    notes.note("reach.no_chain", {},
               fmt::format("group '{}' has no inverse kinematics: {}", name, reason.what()));
  }
}

// True if each joint but the first is below the one before it.
bool is_one_chain(const Model& model, const std::vector<int>& joints) {
  for (std::size_t i = 1; i < joints.size(); ++i) {
    const int upper = model.joints[static_cast<std::size_t>(joints[i - 1])].child_link;
    const int lower = model.joints[static_cast<std::size_t>(joints[i])].parent_link;
    if (upper != lower && !joints_between(model, upper, lower)) return false;
  }
  return !joints.empty();
}

}  // namespace

std::vector<ArmGroup> find_arms(const Model& model, const std::vector<PlanningGroup>& groups,
                                Diagnostics& notes) {
  std::vector<ArmGroup> out;
  for (const PlanningGroup& group : groups) {
    if (group.gripper) continue;
    if (group.tip_link < 0) {
      notes.note("reach.no_chain", {},
                 fmt::format("group '{}' is no chain of joints, so that it has no tip", group.name));
      continue;
    }
    add_arm(model, group.name, group.base_link, group.tip_link, out, notes);
  }
  return out;
}

std::vector<ArmGroup> find_arms(const Model& model, const SrdfDescription& srdf, Diagnostics& notes) {
  std::vector<ArmGroup> out;
  for (const SrdfGroup& group : srdf.groups) {
    if (group.chains.size() == 1) {
      const int base = model.find_link(group.chains[0].base_link),
                tip = model.find_link(group.chains[0].tip_link);
      if (base >= 0 && tip >= 0) add_arm(model, group.name, base, tip, out, notes);
      continue;
    }
    const std::vector<int> joints = joints_of(group, srdf, model);
    if (!is_one_chain(model, joints)) continue;
    const ModelJoint& first = model.joints[static_cast<std::size_t>(joints.front())];
    const ModelJoint& last = model.joints[static_cast<std::size_t>(joints.back())];
    add_arm(model, group.name, first.parent_link, last.child_link, out, notes);
  }
  return out;
}

const ArmGroup& choose_arm(const std::vector<ArmGroup>& arms, const std::string& name) {
  if (arms.empty()) {
    throw InputError("reach.no_arm", {}, "the robot has no arm: no chain of joints that move was found",
                     "name the ends of the chain with --base and --tip");
  }
  if (name.empty()) {
    // A torso or a head comes before the arms that it carries or stands beside.
    return *std::max_element(arms.begin(), arms.end(), [](const ArmGroup& a, const ArmGroup& b) {
      return a.chain.size() < b.chain.size();
    });
  }
  const auto found =
      std::find_if(arms.begin(), arms.end(), [&name](const ArmGroup& arm) { return arm.name == name; });
  if (found != arms.end()) return *found;
  std::vector<std::string> names;
  for (const ArmGroup& arm : arms) names.push_back(arm.name);
  throw InputError("reach.unknown_group", {},
                   fmt::format("the robot has no group '{}'{}", name, did_you_mean(name, names)));
}

}  // namespace doppel
