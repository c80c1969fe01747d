#include "doppel/validation/extras/detail/extra_arm.h"

#include <algorithm>
#include <array>

#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/semantics/self_collision.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

bool is_below(const Model& model, int link, int above) {
  for (int one = link; one >= 0;) {
    if (one == above) return true;
    const int joint = model.links[static_cast<std::size_t>(one)].joint;
    one = joint < 0 ? -1 : model.joints[static_cast<std::size_t>(joint)].parent_link;
  }
  return false;
}

// For each velocity of the model, its rate per rate of each variable.
Eigen::MatrixXd coupling_of(const Model& model, const Chain& chain) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(model.nv, chain.size());
  for (int k = 0; k < chain.size(); ++k) {
    const int leader = chain.variables[static_cast<std::size_t>(k)];
    for (std::size_t i = 0; i < model.joints.size(); ++i) {
      const ModelJoint& joint = model.joints[i];
      if (static_cast<int>(i) == leader) out(joint.v, k) = 1;
      if (joint.scalar() && joint.mimic_leader == leader) out(joint.v, k) = joint.mimic_multiplier;
    }
  }
  return out;
}

}  // namespace

ExtraArm::ExtraArm(const CheckContext& context, const ArmGroup& group)
    : subject_(context.subject), group_(group), start_(start_configuration(context.subject)) {
  Diagnostics none;
  scene_ = reach_scene(subject_.description(), subject_.model, &group.chain, {}, none);
  tool_link_ = chain().tip_link;
  const ToolLoad& tool = context.suite.tool;
  const int chosen = model().find_link(tool.link);
  const int first = joint(0).child_link;
  const bool is_own = tool.link.empty() ? &group == &subject_.arms.front() : is_below(model(), chosen, first);
  if (chosen >= 0 && is_own) tool_link_ = chosen;
  if (is_own) {
    payload_ = tool.mass;
    p_LoC_L_ = tool.p_LoC_L;
  }
  Data data(model());
  forward_kinematics(model(), data, start_);
  first_joint_ =
      data.X_WL[static_cast<std::size_t>(chain().base_link)] * chain().joints.front().X_PZ.translation();
  coupling_ = coupling_of(model(), chain());
}

const ModelJoint& ExtraArm::joint(int variable) const {
  return model().joints[static_cast<std::size_t>(chain().variables[static_cast<std::size_t>(variable)])];
}

const ServoParameters& ExtraArm::servo(int variable) const {
  static const ServoParameters kNone;
  const Model& twin = subject_.robot().model();
  const int index = twin.find_joint(joint(variable).name);
  const std::vector<ServoParameters>& servos = subject_.robot().servos();
  return index < 0 || static_cast<std::size_t>(index) >= servos.size()
             ? kNone
             : servos[static_cast<std::size_t>(index)];
}

Eigen::Vector3d ExtraArm::tool_position(const Data& data) const {
  return data.X_WL[static_cast<std::size_t>(tool_link_)].translation();
}

double ExtraArm::distance(const Data& data) const {
  const Eigen::Vector3d way = tool_position(data) - first_joint_;
  if (gravity().isZero()) return way.norm();
  const Eigen::Vector3d down = gravity().normalized();
  return (way - way.dot(down) * down).norm();
}

Eigen::Matrix<double, 6, Eigen::Dynamic> ExtraArm::tool_jacobian(const Data& data,
                                                                 const Eigen::Vector3d& p_LoP_L) const {
  Eigen::Matrix<double, 6, Eigen::Dynamic> all(6, model().nv);
  jacobian(model(), data, tool_link_, p_LoP_L, all);
  return all * coupling_;
}

Eigen::VectorXd ExtraArm::gravity_load(Data& data, const Eigen::VectorXd& q) const {
  Eigen::VectorXd out(static_cast<Eigen::Index>(model().joints.size()));
  gravity_torques(model(), data, q, gravity());
  drive_torques(model(), data, out);
  return out;
}

Eigen::VectorXd ExtraArm::unit_load(Data& data, const Eigen::VectorXd& q) const {
  Eigen::VectorXd out(static_cast<Eigen::Index>(model().joints.size()));
  Eigen::Matrix<double, 6, Eigen::Dynamic> all(6, model().nv);
  forward_kinematics(model(), data, q);
  jacobian(model(), data, tool_link_, p_LoC_L_, all);
  data.tau = -all.bottomRows<3>().transpose() * gravity();
  drive_torques(model(), data, out);
  return out;
}

std::vector<ArmPlace> ExtraArm::places(int count, std::uint64_t seed) const {
  constexpr int kMaxTries = 20;  // for each
  ArmReach reach = this->reach();
  Data data(model());
  std::vector<ArmPlace> out;
  std::uint64_t state = seed;
  for (int i = 0; i < kMaxTries * count && static_cast<int>(out.size()) < count; ++i) {
    const Eigen::VectorXd random = random_configuration(model(), state);
    Eigen::VectorXd q = start_;
    chain().apply(model(), chain().variables_of(model(), random), q);
    if (!reach.is_free(q)) continue;
    forward_kinematics(model(), data, q);
    out.push_back({std::move(q), distance(data)});
  }
  return out;
}

// A pattern search: each variable in turn by a step that halves.
ArmPlace ExtraArm::farthest(const std::vector<ArmPlace>& places) const {
  constexpr std::array<double, 8> kSteps = {0.4, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002};
  constexpr int kRounds = 20;  // at most, for each step
  ArmReach reach = this->reach();
  Data data(model());
  ArmPlace out = *std::ranges::max_element(places, {}, &ArmPlace::distance);
  const auto improve = [&](double step) {
    bool any = false;
    for (int k = 0; k < chain().size(); ++k) {
      for (const double sign : {1.0, -1.0}) {
        Eigen::VectorXd u = chain().variables_of(model(), out.q);
        u[k] = std::clamp(u[k] + sign * step, chain().lower[k], chain().upper[k]);
        ArmPlace next{out.q, 0};
        chain().apply(model(), u, next.q);
        forward_kinematics(model(), data, next.q);
        next.distance = distance(data);
        if (next.distance <= out.distance || !reach.is_free(next.q)) continue;
        out = std::move(next);
        any = true;
      }
    }
    return any;
  };
  for (const double step : kSteps) {
    for (int round = 0; round < kRounds && improve(step); ++round) {
    }
  }
  return out;
}

std::vector<ExtraArm> extra_arms(const CheckContext& context) {
  std::vector<ExtraArm> out;
  for (const ArmGroup& group : context.subject.arms) {
    const bool is_judged =
        context.joint.empty() || std::ranges::any_of(group.chain.variables, [&](int joint) {
          return context.subject.model->joints[static_cast<std::size_t>(joint)].name == context.joint;
        });
    if (is_judged) out.emplace_back(context, group);
  }
  return out;
}

std::string no_arm_reason(const CheckContext& context) {
  if (!context.subject.arms.empty()) return context.joint + " is no joint of an arm";
  return "no group of joints is an arm: a chain with a tip that is a controller's or SRDF's group";
}

std::vector<NamedPose> named_poses(const CheckContext& context) {
  const Model& model = *context.subject.model;
  std::vector<NamedPose> out{{"start", start_configuration(context.subject)}};
  for (const auto& [name, joints] : context.suite.poses) {
    NamedPose pose{name, model.neutral()};
    for (const auto& [joint, position] : joints) {
      if (const int index = model.find_joint(joint); index >= 0)
        pose.q[model.joints[static_cast<std::size_t>(index)].q] = position;
    }
    model.apply_mimics(pose.q);
    out.push_back(std::move(pose));
  }
  return out;
}

}  // namespace doppel
