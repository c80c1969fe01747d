#pragma once
// All branches of arms whose axes intersect or are parallel in the right places, by sub-problems
// (subproblems.h). An arm whose axes do so nearly, as exports from CAD do, is solved as the nearest exact
// one; the solutions are starting points, which callers refine on the true arm and prove there.
//
//   spherical wrist      six joints, the last three axes meet in a point; Pieper 1968
//   spherical shoulder   the same from the tip to the base
//   parallel axes        four to six joints, axes 2, 3, 4 are parallel, and axes 5 and 6 meet; or the reverse
//   seven joints         one of the above for each position of one joint

#include <Eigen/Core>
#include <array>
#include <optional>

#include "doppel/base/math/pose.h"
#include "doppel/robot/ik/detail/subproblems.h"
#include "doppel/robot/lanes/chain.h"

namespace doppel {

inline constexpr double kExactArm = 1e-9;  // m or rad that axes may miss each other
inline constexpr int kMaxBranches = 16, kMaxAnalyticJoints = 7;

// Axes of revolute joints in the base, at position 0; M: the tip there.
struct ArmAxes {
  int count = 0;
  std::array<Eigen::Vector3d, kMaxAnalyticJoints> h, p;  // unit direction, and a point, m
  Pose M = Pose::Identity();
};

using Branch = std::array<double, kMaxAnalyticJoints>;  // rad, in any turn
struct Branches {
  int count = 0;
  std::array<Branch, kMaxBranches> value;
  void add(const Branch& branch) {
    if (count < kMaxBranches) value[static_cast<std::size_t>(count++)] = branch;
  }
};

enum class ArmKind { spherical_wrist, parallel_axes };

class AnalyticArm {
 public:
  // nullopt: none of the ways fits. `tolerance`: m that axes may miss each other.
  static std::optional<AnalyticArm> find(const ArmAxes& axes, double tolerance);

  // `seed`: rad, decides where an angle is free.
  void solve(const Pose& X_BT, const Branch& seed, Branches& out) const;

  [[nodiscard]] ArmKind kind() const { return kind_; }
  [[nodiscard]] double misfit() const { return misfit_; }  // m or rad by which the axes miss each other
  [[nodiscard]] bool reversed() const { return reversed_; }

 private:
  ArmKind kind_ = ArmKind::spherical_wrist;
  bool reversed_ = false;
  double misfit_ = 0;
  RootMargin margin_;
  ArmAxes axes_;           // as solved: exact, and from the tip to the base if reversed
  Eigen::Vector3d meet_;   // m: the point where the last axes meet
  Eigen::Vector3d along_;  // unit: the direction of the parallel axes
};

// The axes of a chain of revolute joints; nullopt: it has others, mimic joints, or more than seven.
std::optional<ArmAxes> axes_of(const Chain& chain);

// The arm that is left when joint `index` is held at a position.
ArmAxes held_at(const ArmAxes& axes, int index, double position);

// Solutions of the wrist's or shoulder's kind and of parallel axes; used by AnalyticArm.
void solve_spherical_wrist(const ArmAxes& axes, const Eigen::Vector3d& center, const Pose& X_BT,
                           const Branch& seed, const RootMargin& margin, Branches& out);
void solve_parallel_axes(const ArmAxes& axes, const Eigen::Vector3d& meet, const Eigen::Vector3d& along,
                         const Pose& X_BT, const Branch& seed, const RootMargin& margin, Branches& out);

}  // namespace doppel
