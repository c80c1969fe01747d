#include "doppel/validation/statics/start_pose.h"

namespace doppel {

std::vector<std::pair<std::string, double>> posed_joints(const Model& model, const Eigen::VectorXd& q) {
  std::vector<std::pair<std::string, double>> out;
  for (const ModelJoint& joint : model.joints) {
    if (joint.scalar() && !joint.mimics()) out.emplace_back(joint.name, q[joint.q]);
  }
  return out;
}

// The twin's model may have a floating base, which the machine's own model does not have.
Eigen::VectorXd start_configuration(const Subject& subject) {
  const Model& model = *subject.model;
  const ModelInstance& instance = subject.robot().instance();
  Eigen::VectorXd q = model.neutral();
  if (instance.q0.size() != instance.model->nq) return q;
  for (const ModelJoint& joint : model.joints) {
    const int twin = instance.model->find_joint(joint.name);
    if (joint.scalar() && twin >= 0)
      q[joint.q] = instance.q0[instance.model->joints[static_cast<std::size_t>(twin)].q];
  }
  return q;
}

}  // namespace doppel
