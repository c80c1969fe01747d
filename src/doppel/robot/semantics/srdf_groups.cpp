#include "doppel/robot/semantics/srdf_groups.h"

#include <algorithm>
#include <set>

namespace doppel {
namespace {

// The group and all groups in it, each once, so that a loop of groups ends.
void add_subgroups(const SrdfGroup& group, const SrdfDescription& srdf, std::set<const SrdfGroup*>& all) {
  if (!all.insert(&group).second) return;
  for (const SrdfReference& name : group.groups) {
    if (const SrdfGroup* other = srdf.find_group(name.name)) add_subgroups(*other, srdf, all);
  }
}

void add_joints(const SrdfGroup& group, const Model& model, std::set<int>& joints) {
  for (const SrdfReference& name : group.joints) joints.insert(model.find_joint(name.name));
  for (const SrdfReference& name : group.links) {
    const int link = model.find_link(name.name);
    if (link >= 0) joints.insert(model.links[static_cast<std::size_t>(link)].joint);
  }
  for (const SrdfChain& chain : group.chains) {
    const auto between =
        joints_between(model, model.find_link(chain.base_link), model.find_link(chain.tip_link));
    if (between) joints.insert(between->begin(), between->end());
  }
}

}  // namespace

std::vector<int> joints_of(const SrdfGroup& group, const SrdfDescription& srdf, const Model& model) {
  std::set<const SrdfGroup*> groups;
  add_subgroups(group, srdf, groups);
  std::set<int> joints;
  for (const SrdfGroup* one : groups) add_joints(*one, model, joints);
  std::erase_if(joints, [&model](int joint) {
    return joint < 0 || model.joints[static_cast<std::size_t>(joint)].type == JointType::fixed;
  });
  return {joints.begin(), joints.end()};
}

bool contains_itself(const SrdfGroup& group, const SrdfDescription& srdf) {
  std::set<const SrdfGroup*> below;
  for (const SrdfReference& name : group.groups) {
    if (const SrdfGroup* other = srdf.find_group(name.name)) add_subgroups(*other, srdf, below);
  }
  return below.contains(&group);
}

}  // namespace doppel
