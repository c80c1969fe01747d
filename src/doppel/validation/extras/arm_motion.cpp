#include "doppel/validation/extras/detail/arm_motion.h"

#include <algorithm>
#include <cmath>

#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr double kMinMotion = 0.4;  // s
constexpr double kPlayStep = 5e-3;  // s between two looks at the play of the gears

std::vector<std::string> names_of(const ExtraArm& arm) {
  std::vector<std::string> out;
  for (int k = 0; k < arm.chain().size(); ++k) out.push_back(arm.joint(k).name);
  return out;
}

}  // namespace

double quintic(double share) {
  return share * share * share * (10 + share * (6 * share - 15));
}

ArmMotion::ArmMotion(const CheckContext& context, const ExtraArm& arm)
    : arm_(arm),
      machine_(context, {.payload = arm.payload() > 0}),
      names_(names_of(arm)),
      motion_(machine_, names_),
      errors_(context, arm),
      friction_(arm.chain().size()),
      q_(start_configuration(context.subject)),
      data_(arm.model()) {
  for (int k = 0; k < arm.chain().size(); ++k) {
    joints_.push_back(machine_.model().find_joint(names_[static_cast<std::size_t>(k)]));
    friction_[k] = arm.joint(k).friction;
  }
  const std::vector<ModelLink>& links = arm.model().links;
  base_ = std::max(0, machine_.model().find_link(links.front().name));
  tip_ = machine_.model().find_link(links[static_cast<std::size_t>(arm.chain().tip_link)].name);
}

std::string ArmMotion::begin(const Eigen::VectorXd& q) {
  if (!motion_.missing().empty()) return motion_.missing() + " has no position command on a topic";
  if (const Status placed = machine_.place(posed_joints(arm_.model(), q)); !placed)
    return "the pose cannot be taken: " + placed.why();
  machine_.run(0.5);
  follow_play();
  return "";
}

bool ArmMotion::run(const JointMotion::Course& course, double seconds, double rest,
                    const std::function<void(double)>& after_step, const std::function<void()>& every_step) {
  return motion_.run(course, seconds, kCommandStep, rest, [&](double time) {
    if (errors_.any() && to_seconds(machine_.twin().now()) >= next_play_) follow_play();
    if (every_step) every_step();
    if (time >= 0 && after_step) after_step(time);
  });
}

double ArmMotion::motion_time(const Eigen::VectorXd& start, const Eigen::VectorXd& end, double part) const {
  double out = kMinMotion;
  for (int k = 0; k < arm_.chain().size(); ++k) {
    if (std::isfinite(arm_.joint(k).velocity))
      out = std::max(out, kPeakOfQuintic * std::abs(end[k] - start[k]) / (part * arm_.joint(k).velocity));
  }
  return out;
}

JointMotion::Course ArmMotion::straight(Eigen::VectorXd start, Eigen::VectorXd end, double time) {
  return [start = std::move(start), end = std::move(end), time](double now) -> Eigen::VectorXd {
    return start + quintic(std::clamp(now / time, 0.0, 1.0)) * (end - start);
  };
}

Eigen::VectorXd ArmMotion::variables() const {
  Eigen::VectorXd out(arm_.chain().size());
  for (int k = 0; k < arm_.chain().size(); ++k)
    out[k] = machine_.position(joints_[static_cast<std::size_t>(k)]);
  return out;
}

void ArmMotion::follow_play() {
  if (!errors_.any()) return;
  next_play_ = to_seconds(machine_.twin().now()) + kPlayStep;
  const Eigen::VectorXd u = variables();
  arm_.chain().apply(arm_.model(), u, q_);
  Eigen::VectorXd loads = arm_.gravity_load(data_, q_);
  if (arm_.payload() > 0) loads += arm_.payload() * arm_.unit_load(data_, q_);
  Eigen::VectorXd own(arm_.chain().size());
  for (int k = 0; k < arm_.chain().size(); ++k)
    own[k] = loads[arm_.chain().variables[static_cast<std::size_t>(k)]];
  errors_.follow(u, own, friction_);
}

Pose ArmMotion::tool() {
  const Instance& robot = machine_.twin().robot().instance();
  return robot.link_pose(base_).inverse() * robot.link_pose(tip_);
}

Pose ArmMotion::real_tool() {
  const Pose X_RT = tool();
  if (!errors_.any()) return X_RT;
  const Eigen::VectorXd u = variables();
  return X_RT * tip_pose(arm_.chain(), u).inverse() * tip_pose(arm_.chain(), errors_.apply(u));
}

}  // namespace doppel
