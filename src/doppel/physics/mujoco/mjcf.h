#pragma once
// From a world's settings and instances to MJCF text, whose bodies mjcf/mjcf.h writes. Nothing of the user's
// goes into the text: bodies, joints and shapes are named by index over all instances, so that no name needs
// escaping and MuJoCo's messages can be translated into the user's words.

#include <span>
#include <string>
#include <vector>

#include "doppel/physics/exclusions.h"

namespace doppel {

// Where the parts of an instance begin among those of all instances. Bodies stand in the order of
// Model::links, joints in that of Model::q; a floating joint is three slides and a ball, a planar one two
// slides and a hinge. So MuJoCo's arrays are those of the models, one after the other.
struct InstanceOffsets {
  int link = 0, joint = 0, q = 0, v = 0;
};
std::vector<InstanceOffsets> instance_offsets(std::span<const ModelInstance> instances);

// By indices over all instances.
std::string mjcf_link_name(int link);
std::string mjcf_joint_name(int joint);  // of the joint's first degree of freedom
std::string mjcf_exclusion_name(std::size_t pair);

// Up to this many pairs of shapes that may touch, each is looked at by itself; beyond it MuJoCo sorts all
// bodies along an axis in every step, which costs as much as about so many pairs (bench_loop_rate).
inline constexpr std::size_t kMaxListedPairs = 400;

struct MjcfDocument {
  std::string text;
  // Every pair that may become excluded, each an <exclude>; empty: every two shapes that may touch have a
  // <pair>, and MuJoCo looks for no others.
  std::vector<std::pair<BodyId, BodyId>> exclusions;
};
MjcfDocument write_document(const WorldSettings& settings, std::span<const ModelInstance> instances,
                            const Exclusions& exclusions);

// Puts the user's names into a message of MuJoCo's.
std::string in_user_terms(std::string message, std::span<const ModelInstance> instances);

}  // namespace doppel
