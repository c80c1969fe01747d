#include "doppel/twin/loop/detail/shadow.h"

#include <algorithm>
#include <cmath>

#include "doppel/control/hardware/nan.h"

namespace doppel {

Shadow::Shadow(const ControllerManager& manager, const Model& model, MirrorMode mode)
    : manager_(manager), mode_(mode) {
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (!joint.scalar() || joint.mimics()) continue;
    joints_.push_back({static_cast<int>(i), static_cast<std::size_t>(joint.q),
                       static_cast<std::size_t>(joint.v), joint.name + "/" + kPosition,
                       joint.name + "/" + kVelocity});
  }
  q_.resize(static_cast<std::size_t>(model.nq));
  v_.resize(static_cast<std::size_t>(model.nv));
}

double Shadow::position(const Joint& joint) const {
  return manager_.is_read(joint.position) ? manager_.state(joint.position) : kNaN;
}

bool Shadow::is_measured(int joint) const {
  const auto found = std::ranges::find(joints_, joint, &Joint::joint);
  return found != joints_.end() && std::isfinite(position(*found));
}

std::span<const double> Shadow::measured_q(const Instance& robot) {
  std::ranges::copy(robot.q(), q_.begin());
  for (const Joint& one : joints_) {
    if (const double measured = position(one); std::isfinite(measured)) q_[one.q] = measured;
  }
  const auto& joints = robot.model().joints;
  for (const ModelJoint& joint : joints) {
    if (!joint.scalar() || !joint.mimics()) continue;
    const ModelJoint& leader = joints[static_cast<std::size_t>(joint.mimic_leader)];
    q_[static_cast<std::size_t>(joint.q)] =
        joint.mimic_multiplier * q_[static_cast<std::size_t>(leader.q)] + joint.mimic_offset;
  }
  return q_;
}

void Shadow::before_step(Instance robot) {
  const bool shadows = mode_ == MirrorMode::shadow || mode_ == MirrorMode::rehearse;
  commanded_ = shadows && std::ranges::any_of(joints_, [&](const Joint& one) {
                 return std::isfinite(manager_.command(one.position)) && std::isfinite(position(one));
               });
  if (commanded_) {
    command(robot);
  } else if (mode_ != MirrorMode::off) {
    follow(robot);
  }
}

void Shadow::command(Instance robot) const {
  for (const Joint& one : joints_) {
    const double commanded = manager_.command(one.position);
    const double target = std::isfinite(commanded) ? commanded : position(one);
    if (!std::isfinite(target)) continue;
    if (robot.drive(one.joint) != DriveMode::position) robot.set_drive(one.joint, DriveMode::position);
    robot.set_target(one.joint, target);
  }
}

void Shadow::follow(Instance robot) {
  std::ranges::copy(robot.v(), v_.begin());
  for (const Joint& one : joints_) {
    if (!std::isfinite(position(one))) continue;
    const double velocity = manager_.state(one.velocity);
    v_[one.v] = std::isfinite(velocity) ? velocity : 0;
    // A drive that was on its way would pull the joint from the measured position within the step.
    if (robot.drive(one.joint) != DriveMode::passive) robot.set_drive(one.joint, DriveMode::passive);
  }
  robot.set_state(measured_q(robot), v_);
}

}  // namespace doppel
