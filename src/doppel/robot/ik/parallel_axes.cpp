// Three parallel axes after the first: they keep the part of a point along their direction, which leaves the
// first joint alone in one equation; the planar arm that they are is solved last.
#include <Eigen/Geometry>

#include "doppel/robot/ik/detail/analytic_arm.h"
#include "doppel/robot/ik/detail/subproblems.h"

namespace doppel {
namespace {

// Joints 2, 3 and 4, given the others.
void solve_planar(const ArmAxes& axes, const Eigen::Vector3d& meet, const Eigen::Vector3d& along,
                  const Eigen::Vector3d& goal, double sum, const RootMargin& margin, Branch branch,
                  Branches& out) {
  const auto flat = [&along](const Eigen::Vector3d& v) { return Eigen::Vector3d(v - along * along.dot(v)); };
  const Eigen::Vector3d upper = flat(axes.p[2] - axes.p[1]), lower = flat(axes.p[3] - axes.p[2]);
  const Eigen::Vector3d wrist = flat(goal - axes.p[1] - turned(meet - axes.p[3], along, sum));
  // |upper + lower turned by the elbow's angle| = |wrist|.
  const double product = 0.5 * (wrist.squaredNorm() - upper.squaredNorm() - lower.squaredNorm());
  const Angles elbow = angles_to_plane(upper, lower, along, product, margin);
  for (int i = 0; i < elbow.count; ++i) {
    const Eigen::Vector3d reach = upper + turned(lower, along, elbow.value[i]);
    const double shoulder = angle_between(reach, wrist, along).value_or(0);
    const double angles[3] = {shoulder, elbow.value[i], sum - shoulder - elbow.value[i]};
    for (std::size_t k = 0; k < 3; ++k) branch[k + 1] = axes.h[k + 1].dot(along) < 0 ? -angles[k] : angles[k];
    out.add(branch);
  }
}

// Joints 5 and 6, as far as there are any, from the rotation R that 2 to 6 make together.
void solve_after(const ArmAxes& axes, const Eigen::Vector3d& meet, const Eigen::Vector3d& along,
                 const Eigen::Vector3d& goal, const Eigen::Matrix3d& R, const Branch& seed,
                 const RootMargin& margin, Branch branch, Branches& out) {
  const auto with_rest = [&](const Eigen::Matrix3d& rest) {
    const Eigen::Matrix3d planar = R * rest.transpose();
    const Eigen::Vector3d side = along.unitOrthogonal();
    solve_planar(axes, meet, along, goal, angle_between(side, planar * side, along).value_or(0), margin,
                 branch, out);
  };
  if (axes.count == 4) return with_rest(Eigen::Matrix3d::Identity());
  if (axes.count == 5) {
    branch[4] = angle_between(R.transpose() * along, along, axes.h[4]).value_or(seed[4]);
    return with_rest(rotation_about(axes.h[4], branch[4]));
  }
  const Angles fifth = angles_to_plane(along, axes.h[5], axes.h[4], along.dot(R * axes.h[5]), margin);
  for (int i = 0; i < fifth.count; ++i) {
    branch[4] = fifth.value[i];
    const Eigen::Matrix3d R5 = rotation_about(axes.h[4], branch[4]);
    branch[5] = angle_between(R.transpose() * along, R5.transpose() * along, axes.h[5]).value_or(seed[5]);
    with_rest(R5 * rotation_about(axes.h[5], branch[5]));
  }
}

}  // namespace

void solve_parallel_axes(const ArmAxes& axes, const Eigen::Vector3d& meet, const Eigen::Vector3d& along,
                         const Pose& X_BT, const Branch& seed, const RootMargin& margin, Branches& out) {
  const Pose motion = X_BT * axes.M.inverse(Eigen::Isometry);
  const Eigen::Vector3d target = motion * meet - axes.p[0];
  const Angles first = angles_to_plane(along, target, -axes.h[0], along.dot(meet - axes.p[0]), margin);
  for (int i = 0; i < first.count; ++i) {
    Branch branch{};
    branch[0] = first.value[i];
    const Eigen::Matrix3d R1 = rotation_about(axes.h[0], branch[0]);
    solve_after(axes, meet, along, R1.transpose() * target + axes.p[0], R1.transpose() * motion.linear(),
                seed, margin, branch, out);
  }
}

}  // namespace doppel
