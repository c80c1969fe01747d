#pragma once
// The pairs of links that need no collision checking, and the reason, as in MoveIt's setup assistant:
// neighbours, pairs that touch at the start, always, or never in a seeded sample of configurations. Source:
// moveit_setup_assistant, compute_default_collisions.cpp (MoveIt 2).

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/collision/collision_scene.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

enum class DisabledReason { adjacent, by_default, always, never };
DOPPEL_API std::string_view to_string(DisabledReason reason);  // as SRDF writes it: "Default"

struct DisabledPair {
  int link_a = 0, link_b = 0;  // indices into Model::links, a < b
  DisabledReason reason = DisabledReason::never;
};

struct SelfCollisionOptions {
  int samples = 10000;
  std::uint64_t seed = 1;
  CollisionDetail detail = CollisionDetail::triangles;
  // False: pairs that never touch are not searched for, which takes a tenth of the time; others are equal.
  bool find_never = true;
  // Called repeatedly with the completed fraction, 0..1; false: cancels the search. May be empty.
  std::function<bool(double)> progress;
};

struct SelfCollisions {
  std::vector<DisabledPair> disabled;
  int checked_pairs = 0;   // pairs of links with shapes
  bool cancelled = false;  // `progress` returned false; `disabled` is empty
};

// `model` is compiled from `robot`. Links without shapes are in no pair.
DOPPEL_API SelfCollisions find_self_collisions(const RobotDescription& robot, const Model& model,
                                               const SelfCollisionOptions& options);

// The same of instance 0 of a scene, whatever its options: the detail is the scene's.
DOPPEL_API SelfCollisions find_self_collisions(std::shared_ptr<const CollisionScene> scene,
                                               const SelfCollisionOptions& options);

// Two links that touch at a configuration.
struct TouchingPair {
  int link_a = 0, link_b = 0;  // indices into Model::links, as in the list of pairs
  Eigen::VectorXd q;           // [nq] rad, m
};
// The pairs that touch in Model::neutral() or in one of the samples, each with the first such configuration;
// in the order of the list. Only shapes of links in the list are read.
DOPPEL_API std::vector<TouchingPair> find_touching(const RobotDescription& robot, const Model& model,
                                                   const std::vector<std::pair<int, int>>& pairs,
                                                   const SelfCollisionOptions& options);

// A uniformly distributed configuration [nq] within the limits (mimics follow), rad or m; joints without
// limits cover one turn, or 1 m to each side. The same for the same `state` on every machine.
DOPPEL_API Eigen::VectorXd random_configuration(const Model& model, std::uint64_t& state);

}  // namespace doppel
