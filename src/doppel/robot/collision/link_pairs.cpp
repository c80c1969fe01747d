#include "doppel/robot/collision/link_pairs.h"

#include <fmt/format.h>

#include <algorithm>

namespace doppel {

std::vector<int> rigid_groups(const Model& model) {
  std::vector<int> groups(model.links.size(), 0);
  for (const ModelJoint& joint : model.joints) {
    groups[joint.child_link] = joint.type == JointType::fixed ? groups[joint.parent_link] : joint.child_link;
  }
  return groups;
}

std::vector<LinkPair> link_pairs(const Model& model, const LinkShapes& shapes, bool self_collision) {
  const std::vector<int> groups = rigid_groups(model);
  // The joint that moves a group against its parent's group; -1: the root's.
  const auto joint_to_parent = [&](int group) { return model.links[group].joint; };
  const auto joined_by = [&](int upper, int lower) {
    const int joint = joint_to_parent(lower);
    return joint >= 0 && groups[model.joints[joint].parent_link] == upper ? joint : -1;
  };
  std::vector<LinkPair> pairs;
  for (int a = 0; a < static_cast<int>(model.links.size()); ++a) {
    for (int b = a + 1; !shapes[a].empty() && b < static_cast<int>(model.links.size()); ++b) {
      if (shapes[b].empty()) continue;
      LinkPair pair{a, b, ""};
      const int joint = std::max(joined_by(groups[a], groups[b]), joined_by(groups[b], groups[a]));
      if (groups[a] == groups[b]) {
        pair.reason = "one rigid body";
      } else if (joint >= 0) {
        pair.reason = fmt::format("joined by {}", model.joints[joint].name);
      } else if (!self_collision) {
        pair.reason = "self-collision is off";
      }
      pairs.push_back(std::move(pair));
    }
  }
  return pairs;
}

}  // namespace doppel
