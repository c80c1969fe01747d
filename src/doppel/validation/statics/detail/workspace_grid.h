#pragma once
// An arm with its collisions, its free configurations, and the places of the machine's workspace.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "doppel/robot/reach/arm_reach.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

struct JudgedArm {
  const ArmGroup* group = nullptr;
  std::shared_ptr<const Model> model;
  std::shared_ptr<const CollisionScene> scene;

  [[nodiscard]] ArmReach reach() const { return {model, group->chain, scene}; }
  [[nodiscard]] const Chain& chain() const { return group->chain; }
};

// One of Subject::arms with the scene of its collisions.
[[nodiscard]] JudgedArm judged_arm(const Subject& subject, const ArmGroup& group, Diagnostics& notes);

// At most `count` configurations [nq] in which the arm does not touch itself: its own joints random, all
// others neutral.
[[nodiscard]] std::vector<Eigen::VectorXd> free_configurations(const JudgedArm& arm, int count,
                                                               std::uint64_t seed);

// m, root link: the suite's box in its steps, else the largest cube within the sphere that the arm may reach
// with `cells` places on each edge. `arm`: nullptr where the machine has none; without a box there is then no
// place.
struct WorkspaceGrid {
  std::vector<Eigen::Vector3d> points;
  double step = 0;  // m
};
[[nodiscard]] WorkspaceGrid workspace_grid(const CheckContext& context, const JudgedArm* arm, int cells);

}  // namespace doppel
