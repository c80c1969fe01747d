#pragma once
// Which links of a robot never collide, as far as its structure tells.

#include <string>
#include <vector>

#include "doppel/kinematics/model.h"

namespace doppel {

struct LinkPair {
  int a = -1, b = -1;  // model links, a < b
  std::string reason;  // empty: they may collide
};

// A link that lies in the ground or in an object at the start, and never collides with it.
struct Overlap {
  int link = -1;
  std::string object;  // "ground" or the object's name
  double depth = 0;    // m, at the start
};

// For each link, the topmost link it is rigidly joined to through fixed joints.
std::vector<int> rigid_groups(const Model& model);

// Every pair of the links for which `has_shape` holds, with the reason why it never collides: within one
// rigid body, or between two bodies that one joint joins.
std::vector<LinkPair> link_pairs(const Model& model, const std::vector<bool>& has_shape);

}  // namespace doppel
