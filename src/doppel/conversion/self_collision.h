#pragma once
// Which pairs of links need no collision checking, and why, as MoveIt's setup assistant finds it: neighbours,
// pairs that touch at the start, always, or never in a seeded sample of configurations.
// Source: moveit_setup_assistant, compute_default_collisions.cpp (MoveIt 2).

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "doppel/export.h"
#include "doppel/geometry/collision.h"
#include "doppel/kinematics/model.h"

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
  // Told how much is done, 0..1, now and then; false: give up.
  std::function<bool(double)> progress;
};

struct SelfCollisions {
  std::vector<DisabledPair> disabled;
  int checked_pairs = 0;   // pairs of links with shapes
  bool cancelled = false;  // progress said false; `disabled` is empty
};

// `model` is compiled from `robot`. Links without shapes are in no pair.
DOPPEL_API SelfCollisions find_self_collisions(const RobotDescription& robot, const Model& model,
                                               const SelfCollisionOptions& options);

// A configuration within the limits (mimics follow), evenly spread; joints without limits turn all the way
// round, or slide a metre to each side. The same for the same state on every machine.
DOPPEL_API Eigen::VectorXd random_configuration(const Model& model, std::uint64_t& state);

}  // namespace doppel
