// One state without time in each engine.

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "doppel/kinematics/dynamics.h"
#include "doppel/verification/compare_detail.h"

namespace doppel {
namespace {

constexpr Duration kSteps[] = {Duration{4'000}, Duration{2'000}};  // over which accelerations are seen
constexpr double kRate = 1.0, kSlideRate = 0.1;                    // rad/s, m/s

// Free bodies joined by joints with damping.
ModelInstance bare(const ModelInstance& robot) {
  ModelInstance out = robot;
  Model model = *robot.model;
  for (ModelJoint& joint : model.joints) {
    joint.friction = joint.stop_stiffness = 0.0;
    joint.lower = -kInfinity;
    joint.upper = kInfinity;
    joint.mimic_leader = -1;
  }
  out.model = std::make_shared<const Model>(std::move(model));
  out.set_on_ground = false;
  out.servos.assign(out.model->joints.size(), {});
  for (auto& shapes : out.shapes) shapes.clear();
  return out;
}

struct StaticState {
  Eigen::VectorXd q, v, effort;  // efforts of scalar joints
};

// Spread over the limits, with velocities and efforts of fixed random numbers.
std::vector<StaticState> states_of(const Model& limited, int count) {
  std::mt19937 random(20240501);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<StaticState> out;
  for (const Eigen::VectorXd& q : sample_configurations(limited, count)) {
    StaticState state{q, Eigen::VectorXd::Zero(limited.nv), Eigen::VectorXd::Zero(limited.nv)};
    for (const ModelJoint& joint : limited.joints) {
      const double rate = joint.type == JointType::prismatic ? kSlideRate : kRate;
      for (int k = 0; k < joint.nv; ++k) state.v[joint.v + k] = rate * unit(random);
      if (joint.scalar()) state.effort[joint.v] = std::min(joint.effort, 1.0) * unit(random);
    }
    out.push_back(std::move(state));
  }
  return out;
}

double angle_between(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

class EngineStatics {
 public:
  EngineStatics(const MotionSubject& subject, const Model& reference)
      : reference_(reference), data_(reference) {
    for (const Duration step : kSteps) {
      WorldSettings world = subject.world;
      world.ground = false;
      world.step = step;
      Diagnostics heard;
      engines_.push_back(compile_world(subject.engine, world, {bare(subject.robot)}, heard)->make_engine());
    }
    gravity_R_ = subject.robot.X_WR.linear().transpose() * subject.world.gravity;
  }

  std::vector<Pose> poses(const StaticState& state) {
    Instance robot = write(0, state);
    std::vector<Pose> out;
    for (int link = 0; link < static_cast<int>(reference_.links.size()); ++link)
      out.push_back(robot.link_pose(link));
    return out;
  }
  // The efforts that are left over when the accelerations of a step are put into the equations of motion;
  // 0 where the engine computes what they say.
  Eigen::VectorXd residual(std::size_t fineness, const StaticState& state) {
    Instance robot = write(fineness, state);
    for (const ModelJoint& joint : reference_.joints) {
      if (joint.scalar())
        robot.apply_joint_effort(static_cast<int>(&joint - reference_.joints.data()), state.effort[joint.v]);
    }
    engines_[fineness]->step();
    const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(robot.v().data(), reference_.nv);
    const double h = to_seconds(kSteps[fineness]);
    inverse_dynamics(reference_, data_, state.q, state.v, (v - state.v) / h, gravity_R_);
    Eigen::VectorXd out = data_.tau - state.effort;
    for (const ModelJoint& joint : reference_.joints) {
      for (int k = 0; k < joint.nv; ++k) out[joint.v + k] += joint.damping * state.v[joint.v + k];
    }
    return out;
  }
  // How large the efforts of each degree of freedom are.
  Eigen::VectorXd scale(const StaticState& state) {
    inverse_dynamics(reference_, data_, state.q, state.v, Eigen::VectorXd::Ones(reference_.nv), gravity_R_);
    return data_.tau.cwiseAbs() + state.effort.cwiseAbs();
  }

 private:
  Instance write(std::size_t fineness, const StaticState& state) {
    Instance robot = engines_[fineness]->instance(0);
    robot.set_state({state.q.data(), static_cast<std::size_t>(state.q.size())},
                    {state.v.data(), static_cast<std::size_t>(state.v.size())});
    return robot;
  }

  const Model& reference_;
  Data data_;
  Eigen::Vector3d gravity_R_;
  std::vector<std::unique_ptr<Engine>> engines_;
};

// Takes in one more number of each engine, and of each at half the step.
void take(Difference& into, const std::vector<double>& coarse, const std::vector<double>& fine) {
  for (std::size_t a = 0; a < fine.size(); ++a) {
    into.own[a] = std::max(into.own[a], std::abs(coarse[a] - fine[a]));
    for (std::size_t b = 0; b < a; ++b) into.largest = std::max(into.largest, std::abs(fine[a] - fine[b]));
  }
}

}  // namespace

StaticsComparison compare_statics(const std::vector<ComparedEngine>& engines) {
  const Model& limited = *engines.front().subject.robot.model;
  const ModelInstance free = bare(engines.front().subject.robot);
  const Model& model = *free.model;
  std::vector<EngineStatics> at;
  for (const ComparedEngine& engine : engines) {
    if (engine.subject.robot.model->nv != model.nv ||
        engine.subject.robot.model->links.size() != model.links.size())
      throw std::invalid_argument("engines are compared with one robot");
    at.emplace_back(engine.subject, model);
  }
  StaticsComparison out;
  out.configurations = kStaticConfigurations;
  const std::vector<double> none(engines.size(), 0.0);
  for (const ModelLink& link : model.links) out.links.push_back({link.name, "m, rad", 0, 0, none, {}});
  std::vector<double> scales(model.joints.size(), 0.0);
  for (const ModelJoint& joint : model.joints)
    out.joints.push_back({joint.name, joint.type == JointType::prismatic ? "N" : "N m", 0, 0, none, {}});
  for (const StaticState& state : states_of(limited, kStaticConfigurations)) {
    std::vector<std::vector<Pose>> poses;
    std::vector<Eigen::VectorXd> coarse, fine;
    for (EngineStatics& engine : at) {
      poses.push_back(engine.poses(state));
      coarse.push_back(engine.residual(0, state));
      fine.push_back(engine.residual(1, state));
    }
    for (std::size_t link = 0; link < model.links.size(); ++link) {
      for (std::size_t e = 1; e < at.size(); ++e) {
        const Pose &a = poses[0][link], &b = poses[e][link];
        out.links[link].largest = std::max(
            {out.links[link].largest, (a.translation() - b.translation()).norm(), angle_between(a, b)});
      }
    }
    const Eigen::VectorXd scale = at.front().scale(state);
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      const ModelJoint& joint = model.joints[j];
      for (int k = 0; k < joint.nv; ++k) {
        scales[j] = std::max(scales[j], scale[joint.v + k]);
        std::vector<double> of_coarse, of_fine;
        for (std::size_t e = 0; e < at.size(); ++e) {
          of_coarse.push_back(coarse[e][joint.v + k]);
          of_fine.push_back(fine[e][joint.v + k]);
        }
        take(out.joints[j], of_coarse, of_fine);
      }
    }
  }
  for (Difference& link : out.links)
    link.explanation = link.largest > kSamePose ? Explanation::unexplained : Explanation::same;
  for (std::size_t j = 0; j < out.joints.size(); ++j)
    out.joints[j].explanation = explanation_of(out.joints[j], kSameEffort * scales[j]);
  std::vector<Difference> moving;
  for (std::size_t j = 0; j < out.joints.size(); ++j) {
    if (model.joints[j].nv > 0) moving.push_back(out.joints[j]);
  }
  out.joints = std::move(moving);
  lead_with_cause(model, out.joints);
  return out;
}

}  // namespace doppel
