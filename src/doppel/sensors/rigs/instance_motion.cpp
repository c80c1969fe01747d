#include "doppel/sensors/rigs/detail/instance_motion.h"

#include <algorithm>

namespace doppel {

InstanceMotion::InstanceMotion(const Model& model)
    : model_(model),
      noted_{Pose::Identity(), Eigen::VectorXd::Zero(model.nq), Eigen::VectorXd::Zero(model.nv)},
      a_(Eigen::VectorXd::Zero(model.nv)),
      X_WL_(model.links.size(), Pose::Identity()),
      data_(model) {}

void InstanceMotion::note(const Instance& instance) {
  noted_.X_WR = instance.root_pose();
  std::ranges::copy(instance.q(), noted_.q.data());
  std::ranges::copy(instance.v(), noted_.v.data());
}

void InstanceMotion::differentiate(const Instance& instance, double h) {
  for (Eigen::Index i = 0; i < a_.size(); ++i)
    a_[i] = (instance.v()[static_cast<std::size_t>(i)] - noted_.v[i]) / h;
}

void InstanceMotion::note_at_rest(const Instance& instance) {
  note(instance);
  a_.setZero();
}

void InstanceMotion::solve_start(const Eigen::Vector3d& gravity_W) {
  inverse_dynamics(model_, data_, noted_.q, noted_.v, a_, noted_.X_WR.linear().transpose() * gravity_W);
  X_WL_[0] = noted_.X_WR;
  for (const ModelJoint& joint : model_.joints) {
    const auto child = static_cast<std::size_t>(joint.child_link);
    X_WL_[child] = X_WL_[static_cast<std::size_t>(joint.parent_link)] * data_.X_PL[child];
  }
}

void InstanceMotion::solve_end(const Instance& instance, const Eigen::Vector3d& gravity_W) {
  const Eigen::Map<const Eigen::VectorXd> q(instance.q().data(), model_.nq),
      v(instance.v().data(), model_.nv);
  inverse_dynamics(model_, data_, q, v, a_, instance.root_pose().linear().transpose() * gravity_W);
}

}  // namespace doppel
