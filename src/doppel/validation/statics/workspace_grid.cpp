#include "doppel/validation/statics/detail/workspace_grid.h"

#include <cmath>

#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/semantics/self_collision.h"

namespace doppel {

JudgedArm judged_arm(const Subject& subject, const ArmGroup& group, Diagnostics& notes) {
  return {&group, subject.model, reach_scene(subject.description(), subject.model, &group.chain, {}, notes)};
}

std::vector<Eigen::VectorXd> free_configurations(const JudgedArm& arm, int count, std::uint64_t seed) {
  constexpr int kMaxTries = 20;  // for each
  ArmReach reach = arm.reach();
  std::vector<Eigen::VectorXd> out;
  std::uint64_t state = seed;
  for (int i = 0; i < kMaxTries * count && static_cast<int>(out.size()) < count; ++i) {
    const Eigen::VectorXd random = random_configuration(*arm.model, state);
    Eigen::VectorXd q = arm.model->neutral();
    arm.chain().apply(*arm.model, arm.chain().variables_of(*arm.model, random), q);
    if (reach.is_free(q)) out.push_back(std::move(q));
  }
  return out;
}

WorkspaceGrid workspace_grid(const CheckContext& context, const JudgedArm* arm, int cells) {
  const Model& model = *context.subject.model;
  WorkspaceGrid out;
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
  Pose X_WF = Pose::Identity();
  if (context.suite.workspace) {
    const WorkspaceBox& box = *context.suite.workspace;
    low = box.low;
    high = box.high;
    out.step = box.step;
    Data data(model);
    forward_kinematics(model, data, model.neutral());
    if (const int frame = model.find_link(box.frame); frame >= 0)
      X_WF = data.X_WL[static_cast<std::size_t>(frame)];
  } else if (arm != nullptr) {
    const Eigen::Vector3d centre =
        arm->reach().base_pose(model.neutral()) * arm->chain().joints.front().X_PZ.translation();
    const double half = arm->chain().length / std::sqrt(3.0);
    out.step = 2 * half / cells;
    low = centre - Eigen::Vector3d::Constant(half - 0.5 * out.step);
    high = centre + Eigen::Vector3d::Constant(half);
  } else {
    return out;
  }
  const Eigen::Vector3i last =
      ((high - low) / out.step + Eigen::Vector3d::Constant(1e-9)).array().floor().cast<int>();
  for (int i = 0; i <= last.x(); ++i) {
    for (int k = 0; k <= last.y(); ++k) {
      for (int l = 0; l <= last.z(); ++l)
        out.points.push_back(X_WF * (low + out.step * Eigen::Vector3d(i, k, l)));
    }
  }
  return out;
}

}  // namespace doppel
