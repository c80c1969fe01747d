#include "doppel/robot/ik/task_space.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "doppel/base/math/units.h"
#include "doppel/robot/ik/chain_jacobian.h"
#include "doppel/robot/ik/detail/starts.h"

namespace doppel {
namespace {

constexpr int kRankSamples = 16;
// Relative to the largest singular value. Axes that an export from CAD leaves 0.1 degrees askew are not
// freedom.
constexpr double kMinRate = 5e-3;
constexpr double kSnap = 5 * kDegree;
constexpr double kOnAxis = 5e-3;  // of the chain's length

int rank_of(const Chain& chain) {
  const std::vector<double> starts = halton_starts(chain, kRankSamples);
  int rank = 0;
  for (int k = 0; k < kRankSamples; ++k) {
    const Eigen::VectorXd u =
        Eigen::Map<const Eigen::VectorXd>(&starts[static_cast<std::size_t>(k * chain.size())], chain.size());
    const Eigen::VectorXd values = scaled_jacobian(chain, u).jacobiSvd().singularValues();
    rank = std::max(rank, static_cast<int>((values.array() > kMinRate * values[0]).count()));
  }
  return rank;
}

// The axis of the tip's frame that is nearest to a direction, if it is near; else the direction.
Eigen::Vector3d snapped(const Eigen::Vector3d& direction) {
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  axis[largest] = direction[largest] < 0 ? -1 : 1;
  return std::acos(std::min(1.0, axis.dot(direction))) < kSnap ? axis : direction;
}

// A last joint that turns the tool about its own axis: the tip lies on it, and it is not parallel to the
// joint before it, which then swings the tool.
bool rolls_tool(const Chain& chain, double near) {
  const ChainJoint& last = chain.joints.back();
  if (last.prismatic || chain.X_ZT.translation().head<2>().norm() >= near) return false;
  if (chain.joints.size() < 2 || std::abs(chain.X_ZT.translation().z()) >= near) return true;
  return std::abs(last.X_PZ.linear()(2, 2)) < std::cos(kSnap);
}

Eigen::Vector3d tool_axis_of(const Chain& chain) {
  const Pose X_TZ = chain.X_ZT.inverse(Eigen::Isometry);
  const double near = kOnAxis * std::max(chain.length, 1e-6);
  const Pose X_ZP = chain.joints.back().X_PZ.inverse(Eigen::Isometry);  // the joint before, in the last one
  if (rolls_tool(chain, near)) {
    // Along the axis, to the side on which the tip lies; else away from the joint before.
    double side = chain.X_ZT.translation().z();
    if (std::abs(side) < near) side = -X_ZP.translation().z();
    return snapped(X_TZ.linear() * Eigen::Vector3d(0, 0, side < 0 ? -1 : 1));
  }
  Eigen::Vector3d along = -X_TZ.translation();
  if (along.norm() <= near) along = -X_TZ.linear() * X_ZP.translation();
  return along.norm() > near ? snapped(along.normalized()) : Eigen::Vector3d::UnitZ();
}

// The direction of the first joint that turns, which is vertical for most arms.
Eigen::Vector3d reference_axis_of(const Chain& chain) {
  Pose X = Pose::Identity();
  for (const ChainJoint& joint : chain.joints) {
    X = X * joint.X_PZ;
    if (!joint.prismatic) return X.linear().col(2);
  }
  return Eigen::Vector3d::UnitZ();
}

}  // namespace

int dimension(IkTask task) {
  switch (task) {
    case IkTask::pose:
      return 6;
    case IkTask::axis:
      return 5;
    case IkTask::angle:
      return 4;
    case IkTask::position:
      break;
  }
  return 3;
}

TaskSpace find_task_space(const Chain& chain) {
  TaskSpace out;
  out.freedom = rank_of(chain);
  out.task = out.freedom >= 6   ? IkTask::pose
             : out.freedom == 5 ? IkTask::axis
             : out.freedom == 4 ? IkTask::angle
                                : IkTask::position;
  out.tool_axis = tool_axis_of(chain);
  out.reference_axis = reference_axis_of(chain);
  return out;
}

}  // namespace doppel
