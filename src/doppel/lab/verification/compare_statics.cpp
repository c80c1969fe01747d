// Single states without motion in each engine.

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "doppel/lab/verification/detail/compare.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {
namespace {

constexpr Duration kSteps[] = {Duration{4'000}, Duration{2'000}};  // over which accelerations are measured
constexpr double kRate = 1.0, kSlideRate = 0.1;                    // rad/s, m/s
constexpr double kMinEffort = 1e-12;                               // N m or N
constexpr double kPush = 10.0;  // rad/s^2 or m/s^2 that an effort gives the joint's own inertia

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

// Positions spread over the limits, with pseudo-random velocities and efforts of a fixed seed.
std::vector<StaticState> states_of(const Model& limited, int count) {
  std::mt19937 random(20240501);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<StaticState> out;
  Data data(limited);
  for (const Eigen::VectorXd& q : sample_configurations(limited, count)) {
    mass_matrix(limited, data, q);
    StaticState state{q, Eigen::VectorXd::Zero(limited.nv), Eigen::VectorXd::Zero(limited.nv)};
    for (const ModelJoint& joint : limited.joints) {
      const double rate = joint.type == JointType::prismatic ? kSlideRate : kRate;
      for (int k = 0; k < joint.nv; ++k) state.v[joint.v + k] = rate * unit(random);
      if (joint.scalar()) state.effort[joint.v] = kPush * data.M(joint.v, joint.v) * unit(random);
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
      Diagnostics diagnostics;
      engines_.push_back(
          compile_world(subject.engine, world, {bare(subject.robot)}, diagnostics)->make_engine());
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
  // The residual efforts of the equations of motion with the accelerations of a step; 0 if the
  // engine satisfies them.
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
  // The magnitude of the efforts of each degree of freedom.
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

// Sets all engines to one state after the other and keeps the largest differences.
class Statics {
 public:
  Statics(const std::vector<ComparedEngine>& engines, const Model& model) : model_(model) {
    for (const ComparedEngine& engine : engines) {
      if (engine.subject.robot.model->nv != model.nv ||
          engine.subject.robot.model->links.size() != model.links.size())
        throw std::invalid_argument("engines can be compared with one robot only");
      engines_.emplace_back(engine.subject, model);
    }
    const std::vector<double> none(engines.size(), 0.0);
    for (const ModelLink& link : model.links) links.push_back({link.name, "m, rad", 0, 0, none, {}});
    for (const ModelJoint& joint : model.joints)
      joints.push_back({joint.name, joint.type == JointType::prismatic ? "N" : "N m", 0, 0, none, {}});
    scales.assign(model.joints.size(), 0.0);
  }

  void take(const StaticState& state) {
    take_poses(state);
    std::vector<Eigen::VectorXd> coarse, fine;
    for (EngineStatics& engine : engines_) {
      coarse.push_back(engine.residual(0, state));
      fine.push_back(engine.residual(1, state));
    }
    const Eigen::VectorXd scale = engines_.front().scale(state);
    for (std::size_t j = 0; j < joints.size(); ++j) {
      for (int v = std::max(model_.joints[j].v, 0); v < model_.joints[j].v + model_.joints[j].nv; ++v) {
        scales[j] = std::max(scales[j], scale[v]);
        take_effort(joints[j], coarse, fine, v);
      }
    }
  }

  std::vector<Difference> links, joints;  // as in the model
  std::vector<double> scales;             // [joints] largest efforts

 private:
  void take_poses(const StaticState& state) {
    const std::vector<Pose> first = engines_.front().poses(state);
    for (std::size_t e = 1; e < engines_.size(); ++e) {
      const std::vector<Pose> other = engines_[e].poses(state);
      for (std::size_t i = 0; i < links.size(); ++i) {
        links[i].largest =
            std::max({links[i].largest, (first[i].translation() - other[i].translation()).norm(),
                      angle_between(first[i], other[i])});
      }
    }
  }
  static void take_effort(Difference& into, const std::vector<Eigen::VectorXd>& coarse,
                          const std::vector<Eigen::VectorXd>& fine, int v) {
    for (std::size_t a = 0; a < fine.size(); ++a) {
      into.own[a] = std::max(into.own[a], std::abs(coarse[a][v] - fine[a][v]));
      for (std::size_t b = 0; b < a; ++b) {
        // Extrapolated to step 0, so that engines with different schemes can be compared.
        const double difference = 2 * (fine[a][v] - fine[b][v]) - (coarse[a][v] - coarse[b][v]);
        into.largest = std::max(into.largest, std::abs(difference));
      }
    }
  }

  const Model& model_;
  std::vector<EngineStatics> engines_;
};

}  // namespace

StaticsComparison compare_statics(const std::vector<ComparedEngine>& engines) {
  const ModelInstance free = bare(engines.front().subject.robot);
  const Model& model = *free.model;
  Statics statics(engines, model);
  for (const StaticState& state : states_of(*engines.front().subject.robot.model, kStaticConfigurations))
    statics.take(state);
  StaticsComparison out;
  out.configurations = kStaticConfigurations;
  out.links = std::move(statics.links);
  for (Difference& link : out.links)
    link.explanation = link.largest > kSamePose ? Explanation::unexplained : Explanation::same;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].nv == 0) continue;
    Difference& joint = out.joints.emplace_back(std::move(statics.joints[j]));
    // The error of the extrapolation is of second order in the own errors.
    Difference left = joint;
    for (double& own : left.own) own *= own / std::max(statics.scales[j], kMinEffort);
    joint.explanation = explanation_of(left, kSameEffort * statics.scales[j]);
  }
  lead_with_cause(model, out.joints);
  return out;
}

}  // namespace doppel
