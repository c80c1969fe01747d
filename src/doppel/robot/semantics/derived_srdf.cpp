#include "doppel/robot/semantics/derived_srdf.h"

namespace doppel {
namespace {

SrdfGroup group_of(const Model& model, const PlanningGroup& group) {
  SrdfGroup out{.name = group.name};
  if (group.base_link >= 0) {
    out.chains.push_back({model.links[group.base_link].name, model.links[group.tip_link].name});
    return out;
  }
  for (const int joint : group.joints) out.joints.push_back({model.joints[joint].name});
  return out;
}

// Zero, or the limit nearest to it.
SrdfGroupState home_of(const Model& model, const PlanningGroup& group) {
  const Eigen::VectorXd q = model.neutral();
  SrdfGroupState out{.name = "home", .group = group.name};
  for (const int index : group.joints) {
    const ModelJoint& joint = model.joints[index];
    if (!joint.mimics()) out.values.push_back({joint.name, {q[joint.q]}});
  }
  return out;
}

}  // namespace

SrdfDescription derived_srdf(const Model& model, const std::vector<PlanningGroup>& groups,
                             const std::vector<DisabledPair>& disabled) {
  SrdfDescription out{.robot = model.name};
  for (const PlanningGroup& group : groups) {
    out.groups.push_back(group_of(model, group));
    out.states.push_back(home_of(model, group));
    if (!group.gripper || group.parent_link < 0) continue;
    out.end_effectors.push_back({group.name + "_ee", model.links[group.parent_link].name, group.name,
                                 group.parent_group < 0 ? "" : groups[group.parent_group].name});
  }
  if (const std::string& root = model.links[0].name; root != "world")
    out.virtual_joints.push_back({"virtual_joint", "fixed", "world", root});
  for (const ModelJoint& joint : model.joints) {
    if (joint.mimics()) out.passive_joints.push_back({joint.name});
  }
  for (const DisabledPair& pair : disabled) {
    out.disabled.push_back(
        {model.links[pair.link_a].name, model.links[pair.link_b].name, std::string(to_string(pair.reason))});
  }
  return out;
}

}  // namespace doppel
