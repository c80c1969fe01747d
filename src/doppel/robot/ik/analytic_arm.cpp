#include "doppel/robot/ik/detail/analytic_arm.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "doppel/robot/ik/detail/subproblems.h"

namespace doppel {
namespace {

constexpr double kParallel = 0.02;  // rad that axes may miss being parallel
constexpr RootMargin kNearMargin{0.02, 0.15};

// The point that is nearest to several axes.
Eigen::Vector3d meeting_point(const ArmAxes& axes, int first, int count) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity() * 1e-9;  // decides where all axes are parallel
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (int i = first; i < first + count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axes.h[k] * axes.h[k].transpose();
    A += across;
    b += across * axes.p[k] + 1e-9 / count * axes.p[k];
  }
  return A.ldlt().solve(b);
}

double distance_to_axis(const ArmAxes& axes, int index, const Eigen::Vector3d& point) {
  const auto k = static_cast<std::size_t>(index);
  return axes.h[k].cross(point - axes.p[k]).norm();
}

// The largest distance of a point from several axes.
double misses(const ArmAxes& axes, int first, int count, const Eigen::Vector3d& point) {
  double out = 0;
  for (int i = first; i < first + count; ++i) out = std::max(out, distance_to_axis(axes, i, point));
  return out;
}

double angle_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b)));
}

// The same arm from the tip to the base: its angles are those of the arm with the other sign, last joint
// first.
ArmAxes reverse_of(const ArmAxes& axes) {
  ArmAxes out;
  out.count = axes.count;
  out.M = axes.M.inverse(Eigen::Isometry);
  for (int i = 0; i < axes.count; ++i) {
    const auto source = static_cast<std::size_t>(axes.count - 1 - i), k = static_cast<std::size_t>(i);
    out.h[k] = out.M.linear() * axes.h[source];
    out.p[k] = out.M * axes.p[source];
  }
  return out;
}

// Neighbours that are nearly parallel become parallel, so that the sub-problems do not divide by what is
// left.
double align_neighbours(ArmAxes& axes) {
  double moved = 0;
  for (int i = 1; i < axes.count; ++i) {
    const Eigen::Vector3d& before = axes.h[static_cast<std::size_t>(i - 1)];
    Eigen::Vector3d& h = axes.h[static_cast<std::size_t>(i)];
    const double angle = angle_of(before, h);
    if (angle >= kParallel) continue;
    moved = std::max(moved, angle);
    h = before.dot(h) < 0 ? Eigen::Vector3d(-before) : before;
  }
  return moved;
}

// The point where axes 5 and 6 meet, or one of axis 5, or the tip.
Eigen::Vector3d end_of_planar(const ArmAxes& axes) {
  if (axes.count == 4) return axes.M.translation();
  if (axes.count == 5) {
    const Eigen::Vector3d& h = axes.h[4];
    return axes.p[4] + h * h.dot(axes.M.translation() - axes.p[4]);
  }
  return meeting_point(axes, 4, 2);
}

}  // namespace

std::optional<ArmAxes> axes_of(const Chain& chain) {
  const auto count = static_cast<int>(chain.joints.size());
  if (!chain.direct || count > kMaxAnalyticJoints) return std::nullopt;
  ArmAxes axes;
  axes.count = count;
  for (const ChainJoint& joint : chain.joints) {
    if (joint.prismatic) return std::nullopt;
  }
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(chain.size());
  axes.M = walk(chain, zero, [&](std::size_t i, const Eigen::Vector3d& z_B, const Eigen::Vector3d& p_B) {
    axes.h[i] = z_B;
    axes.p[i] = p_B;
  });
  return axes;
}

ArmAxes held_at(const ArmAxes& axes, int index, double position) {
  ArmAxes out;
  out.count = axes.count - 1;
  const auto held = static_cast<std::size_t>(index);
  const Eigen::Matrix3d R = rotation_about(axes.h[held], position);
  for (int i = 0; i < axes.count; ++i) {
    if (i == index) continue;
    const auto source = static_cast<std::size_t>(i), k = static_cast<std::size_t>(i < index ? i : i - 1);
    const bool before = i < index;
    out.h[k] = before ? axes.h[source] : Eigen::Vector3d(R * axes.h[source]);
    out.p[k] = before ? axes.p[source] : Eigen::Vector3d(R * (axes.p[source] - axes.p[held]) + axes.p[held]);
  }
  out.M.linear() = R * axes.M.linear();
  out.M.translation() = R * (axes.M.translation() - axes.p[held]) + axes.p[held];
  return out;
}

std::optional<AnalyticArm> AnalyticArm::find(const ArmAxes& axes, double tolerance) {
  if (axes.count < 4 || axes.count > 6) return std::nullopt;
  std::optional<AnalyticArm> best;
  for (const bool reversed : {false, true}) {
    AnalyticArm arm;
    arm.reversed_ = reversed;
    arm.axes_ = reversed ? reverse_of(axes) : axes;
    const double aligned = align_neighbours(arm.axes_);
    const auto offer = [&](ArmKind kind, double misfit) {
      if (misfit > tolerance || (best && best->misfit_ <= misfit + kExactArm)) return;
      arm.kind_ = kind;
      arm.misfit_ = std::max(misfit, aligned);
      arm.margin_ = arm.misfit_ > kExactArm ? kNearMargin : RootMargin{};
      best = arm;
    };
    const double parallel =
        std::max(angle_of(arm.axes_.h[1], arm.axes_.h[2]), angle_of(arm.axes_.h[1], arm.axes_.h[3]));
    if (parallel < kExactArm && angle_of(arm.axes_.h[0], arm.axes_.h[1]) > kParallel &&
        (axes.count == 6 || !reversed)) {
      arm.meet_ = end_of_planar(arm.axes_);
      arm.along_ = arm.axes_.h[1];
      offer(ArmKind::parallel_axes, axes.count == 6 ? misses(arm.axes_, 4, 2, arm.meet_) : 0);
    }
    if (axes.count == 6) {
      arm.meet_ = meeting_point(arm.axes_, 3, 3);
      const double flat =
          std::min(angle_of(arm.axes_.h[3], arm.axes_.h[4]), angle_of(arm.axes_.h[4], arm.axes_.h[5]));
      if (flat > kParallel) offer(ArmKind::spherical_wrist, misses(arm.axes_, 3, 3, arm.meet_));
    }
  }
  return best;
}

void AnalyticArm::solve(const Pose& X_BT, const Branch& seed, Branches& out) const {
  const auto run = [this, &out](const Pose& target, const Branch& start) {
    if (kind_ == ArmKind::spherical_wrist) {
      solve_spherical_wrist(axes_, meet_, target, start, margin_, out);
    } else {
      solve_parallel_axes(axes_, meet_, along_, target, start, margin_, out);
    }
  };
  if (!reversed_) return run(X_BT, seed);
  const auto exchange = [this](const Branch& branch) {
    Branch reversed{};
    for (int i = 0; i < axes_.count; ++i)
      reversed[static_cast<std::size_t>(i)] = -branch[static_cast<std::size_t>(axes_.count - 1 - i)];
    return reversed;
  };
  const int before = out.count;
  run(X_BT.inverse(Eigen::Isometry), exchange(seed));
  for (int i = before; i < out.count; ++i) {
    Branch& branch = out.value[static_cast<std::size_t>(i)];
    branch = exchange(branch);
  }
}

}  // namespace doppel
