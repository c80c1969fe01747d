#pragma once
// The displacement of a tool by the drives that yield under a load at rest.

#include <Eigen/Core>

#include "doppel/validation/extras/detail/extra_arm.h"

namespace doppel {

struct ToolSag {
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // m, root link
  int variable = -1;                                       // of the chain: the drive with the largest part
};

// -J K^-1 g(q) at the origin of the tool's link; g: the load on each drive, with a payload in kg. Rigid
// links, no friction, no limits.
[[nodiscard]] ToolSag tool_sag(const ExtraArm& arm, Data& data, const Eigen::VectorXd& q, double payload);

}  // namespace doppel
