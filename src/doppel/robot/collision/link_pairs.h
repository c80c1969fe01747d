#pragma once
// The pairs of a model's links that can never collide, by the structure of the model alone.

#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/collision/link_shapes.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// For each link, the topmost link that it is rigidly joined to by fixed joints; 0: it is fixed to the root.
DOPPEL_API std::vector<int> rigid_groups(const Model& model);

struct LinkPair {
  int a = -1, b = -1;  // links of one model, a < b
  std::string reason;  // empty: they may collide
};
// Every pair of links with shapes, with the reason why it never collides: within one rigid body, between two
// bodies that one joint joins, or because the model does not collide with itself.
DOPPEL_API std::vector<LinkPair> link_pairs(const Model& model, const LinkShapes& shapes,
                                            bool self_collision = true);

}  // namespace doppel
