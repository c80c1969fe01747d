#include "doppel/review/identification/motion_plan.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "doppel/base/core/names.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/physics/contract/described_servo.h"
#include "doppel/review/identification/detail/release_plan.h"
#include "doppel/review/identification/detail/servo_simulation.h"
#include "doppel/review/identification/recorded_motion.h"
#include "doppel/robot/clearance/clearance.h"
#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/semantics/self_collision.h"

namespace doppel {
namespace {

using identification_detail::ServoSimulation;
using Quantity = ServoQuantity;

constexpr int kCandidates = 24;
constexpr double kSeriesTime = 15;         // s, of the candidates: three periods
constexpr double kRate = 100;              // Hz
constexpr int kCollisionSamples = 300;     // for pairs that always touch
constexpr int kGrid = 41;                  // positions at which load and inertia are computed
constexpr double kShrink = 0.8;            // of the amplitude, where effort or clearance need it
constexpr double kDifference = 3e-2;       // of a parameter's logarithm
constexpr double kPlanPadding = 0.005;     // m, between links
constexpr double kSlack = 1e-6;            // of a limit
constexpr double kDefaultFriction = 0.02;  // of the effort limit, where no friction is described
const Eigen::Vector3d kDown(0, 0, -9.81);

// Load and inertia of one joint over its range, the others held.
class JointLoads {
 public:
  JointLoads(const Model& model, int joint, Eigen::VectorXd q, double low, double high)
      : low_(low), step_((high - low) / (kGrid - 1)) {
    Data data(model);
    const ModelJoint& moved = model.joints[static_cast<std::size_t>(joint)];
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(model.nv);
    direction[moved.v] = 1;
    for (const ModelJoint& other : model.joints) {
      if (other.mimic_leader == joint) direction[other.v] = other.mimic_multiplier;
    }
    for (int i = 0; i < kGrid; ++i) {
      q[moved.q] = low + i * step_;
      model.apply_mimics(q);
      gravity_torques(model, data, q, kDown);
      load_.push_back(direction.dot(data.tau));
      mass_matrix(model, data, q);
      inertia_.push_back(direction.dot(data.M * direction));
    }
  }
  [[nodiscard]] double load(double position) const { return value(load_, position); }
  [[nodiscard]] double inertia(double position) const { return value(inertia_, position); }

 private:
  [[nodiscard]] double value(const std::vector<double>& grid, double position) const {
    const double x = std::clamp((position - low_) / step_, 0.0, kGrid - 1.0);
    const auto i = std::min(static_cast<std::size_t>(x), grid.size() - 2);
    return grid[i] + (x - static_cast<double>(i)) * (grid[i + 1] - grid[i]);
  }
  double low_, step_;
  std::vector<double> load_, inertia_;
};

JointRecord record_of(const std::vector<Waypoint>& path, const JointLoads& loads) {
  JointRecord out;
  std::size_t k = 0;
  for (std::size_t i = 0; static_cast<double>(i) / kRate < path.back().time; ++i) {
    const double t = static_cast<double>(i) / kRate;
    while (k + 1 < path.size() && path[k].time < t) ++k;
    const double begin = k > 0 ? path[k - 1].time : 0.0;
    const double before = k > 0 ? path[k - 1].position : path.front().position;
    const double q =
        before + (path[k].position - before) * std::clamp((t - begin) / (path[k].time - begin), 0.0, 1.0);
    out.time.push_back(t);
    out.position.push_back(q);
    out.load.push_back(loads.load(q));
    out.inertia.push_back(loads.inertia(q));
  }
  out.command_time = out.time;
  out.command = out.position;
  return out;
}

// The condition number of the Jacobian of the positions with respect to the logarithms of what the harmonics
// excite, its columns scaled to one length.
double condition_of(const JointRecord& record, const ServoValues& values) {
  constexpr std::array kExcited{Quantity::delay,    Quantity::stiffness, Quantity::damping,
                                Quantity::armature, Quantity::viscous,   Quantity::friction};
  ServoSimulation simulation(record);
  const auto n = static_cast<Eigen::Index>(record.time.size());
  std::vector<double> above(record.time.size()), below(record.time.size());
  Eigen::MatrixXd J(n, static_cast<Eigen::Index>(kExcited.size()));
  for (std::size_t j = 0; j < kExcited.size(); ++j) {
    ServoValues aside = values;
    double& value = aside[static_cast<std::size_t>(kExcited[j])];
    value *= std::exp(kDifference);
    simulation.run(aside, above);
    value *= std::exp(-2 * kDifference);
    simulation.run(aside, below);
    auto column = J.col(static_cast<Eigen::Index>(j));
    column = Eigen::Map<const Eigen::VectorXd>(above.data(), n) -
             Eigen::Map<const Eigen::VectorXd>(below.data(), n);
    const double length = column.norm();
    if (!(length > 0)) return kInfinity;
    column /= length;
  }
  const Eigen::VectorXd values_of =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(J.transpose() * J).eigenvalues();
  return values_of[0] > 0 ? std::sqrt(values_of[values_of.size() - 1] / values_of[0]) : kInfinity;
}

// Numbers of a fixed sequence (Steele, Lea, Flood 2014: SplitMix).
double next_number(std::uint64_t& state) {
  std::uint64_t z = state += 0x9e3779b97f4a7c15U;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
  return 2 * static_cast<double>((z ^ (z >> 31U)) >> 11U) * 0x1p-53 - 1;
}

// The drive's effort as a share of its limit: gravity, inertia and friction in the harmonics.
double effort_share(const std::vector<Waypoint>& path, const JointLoads& loads, const ModelJoint& joint) {
  if (!std::isfinite(joint.effort)) return 0;
  double most = 0;
  for (std::size_t i = 1; i + 1 < path.size(); ++i) {
    const double before = path[i].time - path[i - 1].time, after = path[i + 1].time - path[i].time;
    if (!(before > 0) || std::abs(before - after) > kSlack) continue;
    const double a = (path[i + 1].position - 2 * path[i].position + path[i - 1].position) / (before * before);
    const double q = path[i].position;
    most = std::max(most, std::abs(loads.load(q)) + loads.inertia(q) * std::abs(a) + joint.friction);
  }
  return most / joint.effort;
}

double speed_share(const std::vector<Waypoint>& path, const ModelJoint& joint) {
  double most = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double time = path[i].time - path[i - 1].time;
    most = std::max(most, std::abs(path[i].position - path[i - 1].position) / time);
  }
  return std::isfinite(joint.velocity) ? most / joint.velocity : 0.0;
}

// The arm among its links and above the ground.
class Surroundings {
 public:
  Surroundings(const RobotDescription& robot, const Model& model, const Eigen::VectorXd& q) : model_(model) {
    const SceneInstance instance = described_robot(robot, model);
    const auto covers = make_covers(instance);
    for (const bool ground : {true, false}) {
      auto scene = std::make_shared<const CollisionScene>(
          std::vector{instance}, SceneOptions{.ground = ground, .detail = CollisionDetail::triangles});
      std::vector<AllowedPair> allowed;
      SelfCollisionOptions search;
      search.samples = kCollisionSamples;
      search.find_never = false;
      for (const DisabledPair& pair : find_self_collisions(scene, search).disabled) {
        if (pair.reason == DisabledReason::always || pair.reason == DisabledReason::by_default)
          allowed.push_back({{0, pair.link_a}, {0, pair.link_b}, "always"});
      }
      clearance_ = std::make_unique<Clearance>(scene->allowing(allowed), std::vector{covers},
                                               ClearanceOptions{.padding = kPlanPadding});
      const StateClearance state = clearance_->state(q);
      if (state.free) return;
      touching_ = names_of(state.a, state.b);
    }
    throw InputError(
        "identify.collision", robot.source,
        fmt::format("in the pose of the plan {} are nearer than {:.0f} mm", touching_, 1e3 * kPlanPadding),
        "give another pose: --pose JOINT=POSITION");
  }
  // Empty: the joint may move from `low` to `high`; else what touches, and where.
  std::string hit(const ModelJoint& joint, Eigen::VectorXd q, double low, double high) {
    Eigen::VectorXd end = q;
    q[joint.q] = low;
    end[joint.q] = high;
    model_.apply_mimics(q);
    model_.apply_mimics(end);
    const EdgeClearance edge = clearance_->edge(q, end);
    if (edge.free) return "";
    return fmt::format("{} touch at {:.3g}", names_of(edge.a, edge.b), low + edge.parameter * (high - low));
  }

 private:
  [[nodiscard]] std::string names_of(BodyId a, BodyId b) const {
    const auto name = [&](BodyId body) {
      return body.instance < 0 ? std::string("the ground")
                               : fmt::format("'{}'", model_.links[static_cast<std::size_t>(body.link)].name);
    };
    return fmt::format("{} and {}", name(a), name(b));
  }
  const Model& model_;
  std::unique_ptr<Clearance> clearance_;
  std::string touching_;
};

class Planner {
 public:
  Planner(const RobotDescription& robot, const Model& model, const PlanOptions& options)
      : model_(model),
        loaded_(options.payload ? loaded_model(model, *options.payload) : model),
        options_(options),
        q_(options.q),
        servos_(choose_servos(robot, model, {}, kDown)) {
    for (const std::string& name : model.driven_joint_names()) make_room(joint_named(name));
    model.apply_mimics(q_);
    surroundings_.emplace(robot, model, q_);
  }

  MotionPlan run(const std::string& name) {
    MotionPlan out;
    out.robot = name;
    out.arm = arm_hash(model_);
    if (options_.payload) {
      out.payload = options_.payload;
      out.payload->link = payload_link(model_, *options_.payload);
      out.notes.push_back(
          fmt::format("the efforts are those with {:.4g} kg at '{}'; the weight's shape is not described, so "
                      "that what it would "
                      "touch is not known",
                      out.payload->mass, out.payload->link));
    }
    const std::vector<std::string> all = model_.driven_joint_names();
    for (const std::string& joint : all) out.pose[joint] = q_[joint_named(joint).q];
    for (const std::string& joint : options_.joints.empty() ? all : options_.joints) {
      if (std::ranges::find(all, joint) == all.end())
        throw InputError("cli.use", {},
                         fmt::format("the robot has no driven joint '{}'{}", joint, did_you_mean(joint, all)),
                         "doppel tree lists links and joints");
      plan_joint(joint, out);
    }
    if (out.joints.empty()) {
      throw InputError("identify.no_plan", {},
                       "no joint is left: " + (out.notes.empty() ? "" : out.notes.front()),
                       "give another pose: --pose JOINT=POSITION");
    }
    return out;
  }

 private:
  [[nodiscard]] const ModelJoint& joint_named(const std::string& name) const {
    return model_.joints[static_cast<std::size_t>(model_.find_joint(name))];
  }
  [[nodiscard]] ExcitationRange range_of(const ModelJoint& joint) const {
    return {q_[joint.q], joint.lower, joint.upper, joint.velocity, joint.type == JointType::prismatic};
  }
  void make_room(const ModelJoint& joint) {
    if (excitation_amplitude(range_of(joint)) <= 0 && std::isfinite(joint.upper - joint.lower))
      q_[joint.q] = 0.5 * (joint.lower + joint.upper);
  }
  FourierSeries best_series(const ExcitationRange& range, const JointLoads& loads, const ServoValues& values,
                            double& condition) const;
  void plan_joint(const std::string& name, MotionPlan& out);
  void add_release(const ModelJoint& joint, const ExcitationRange& range, const JointLoads& loads,
                   PlannedJoint& planned, MotionPlan& out) const;
  [[nodiscard]] ServoValues values_of(const ModelJoint& joint, int index, const JointRecord& record) const;

  const Model& model_;
  const Model loaded_;  // with the payload
  const PlanOptions& options_;
  Eigen::VectorXd q_;
  std::vector<ServoParameters> servos_;
  std::optional<Surroundings> surroundings_;
};

ServoValues Planner::values_of(const ModelJoint& joint, int index, const JointRecord& record) const {
  ServoValues out = start_values(joint, servos_[static_cast<std::size_t>(index)], record);
  for (const Quantity upper :
       {Quantity::breakaway, Quantity::stribeck, Quantity::load_factor, Quantity::backlash})
    out[static_cast<std::size_t>(upper)] = 0;
  double& friction = out[static_cast<std::size_t>(Quantity::friction)];
  friction = std::max(friction, kDefaultFriction * out[static_cast<std::size_t>(Quantity::effort)]);
  return out;
}

FourierSeries Planner::best_series(const ExcitationRange& range, const JointLoads& loads,
                                   const ServoValues& values, double& condition) const {
  FourierSeries best = schroeder_series();
  condition = condition_of(record_of(plan_harmonics(range, kSeriesTime, best), loads), values);
  std::uint64_t state = 1;
  for (int i = 1; i < kCandidates; ++i) {
    FourierSeries one;
    for (int k = 1; k <= kHarmonics; ++k) {
      one.a[static_cast<std::size_t>(k - 1)] = next_number(state) / k;
      one.b[static_cast<std::size_t>(k - 1)] = next_number(state) / k;
    }
    const double reached = condition_of(record_of(plan_harmonics(range, kSeriesTime, one), loads), values);
    if (reached < condition) condition = reached, best = one;
  }
  return best;
}

// Within the span that is free of contacts, from the position to its furthest on either side.
void Planner::add_release(const ModelJoint& joint, const ExcitationRange& range, const JointLoads& loads,
                          PlannedJoint& planned, MotionPlan& out) const {
  const double furthest = excitation_amplitude(range);
  const double described = std::isfinite(joint.effort) ? kDefaultFriction * joint.effort : 0.0;
  const identification_detail::FallingJoint falling{range.position - furthest,
                                                    range.position + furthest,
                                                    joint.velocity,
                                                    joint.effort,
                                                    joint.friction > 0 ? joint.friction : described,
                                                    range.slides,
                                                    [&loads](double q) { return loads.load(q); },
                                                    [&loads](double q) { return loads.inertia(q); }};
  PlannedRelease release;
  const std::string problem = identification_detail::plan_release(falling, release);
  if (problem.empty()) {
    planned.release = release;
  } else {
    out.notes.push_back(fmt::format("'{}': lift and release are omitted: {}", planned.joint, problem));
  }
}

void Planner::plan_joint(const std::string& name, MotionPlan& out) {
  const int index = model_.find_joint(name);
  const ModelJoint& joint = joint_named(name);
  ExcitationRange range = range_of(joint);
  const double room = excitation_amplitude(range);
  if (room <= 0) {
    out.notes.push_back(fmt::format("'{}' is left out: its limits leave no room", name));
    return;
  }
  const JointLoads loads(loaded_, index, q_, range.position - room, range.position + room);
  std::string problem;
  range.furthest = room / kShrink;
  while (true) {
    range.furthest *= kShrink;
    if (excitation_amplitude(range) <= 0) break;
    problem = surroundings_->hit(joint, q_, range.position - range.furthest, range.position + range.furthest);
    if (!problem.empty()) continue;
    PlannedJoint planned;
    planned.joint = name;
    const JointRecord first = record_of(plan_harmonics(range, kSeriesTime, schroeder_series()), loads);
    const FourierSeries series = best_series(range, loads, values_of(joint, index, first), planned.condition);
    planned.path = plan_excitation(range, options_.seconds, series);
    planned.effort = effort_share(planned.path, loads, joint);
    planned.speed = speed_share(planned.path, joint);
    if (planned.effort <= kMaxEffort) {
      add_release(joint, range, loads, planned, out);
      out.joints.push_back(std::move(planned));
      return;
    }
    problem = fmt::format("it needs {:.0f} % of its effort limit, {:.0f} % are permitted",
                          100 * planned.effort, 100 * kMaxEffort);
  }
  out.notes.push_back(fmt::format("'{}' is left out: {}", name, problem));
}

bool is_within(const PlannedRelease& release, const ModelJoint& joint) {
  const bool rises = joint.lower - kSlack <= release.lower && release.lower <= release.lift &&
                     release.lift <= release.upper && release.upper <= joint.upper + kSlack;
  return rises && release.speed > 0 && release.speed <= kExcitationSpeed * joint.velocity * (1 + 1e-3) &&
         release.duration > 0 && release.duration <= kMaxRelease;
}

}  // namespace

MotionPlan plan_motion(const RobotDescription& robot, const Model& model, const PlanOptions& options) {
  return Planner(robot, model, options).run(robot.name);
}

void check_plan(const MotionPlan& plan, const Model& model, const std::string& file) {
  if (plan.arm != arm_hash(model)) {
    throw InputError("identify.another_arm", make_location(file),
                     fmt::format("the plan is of another arm: '{}', hash {}; this one is '{}', hash {}",
                                 plan.robot, plan.arm, model.name, arm_hash(model)),
                     "make a plan of this arm: doppel identify plan");
  }
  for (const PlannedJoint& planned : plan.joints) {
    const int index = model.find_joint(planned.joint);
    if (index < 0 || planned.path.empty() || !plan.pose.contains(planned.joint))
      throw InputError("identify.plan", make_location(file),
                       fmt::format("the plan of '{}' is incomplete", planned.joint), "doppel identify plan");
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(index)];
    double time = 0, position = plan.pose.at(planned.joint);
    for (const Waypoint& point : planned.path) {
      const double speed = std::abs(point.position - position) / (point.time - time);
      const bool within = point.position >= joint.lower - kSlack && point.position <= joint.upper + kSlack;
      if (!within || !(point.time > time) || speed > kExcitationSpeed * joint.velocity * (1 + 1e-3)) {
        throw InputError(
            "identify.plan", make_location(file),
            fmt::format("the plan of '{}' leaves its limits at {:.3f} s", planned.joint, point.time),
            "a plan is not to be edited: doppel identify plan");
      }
      time = point.time;
      position = point.position;
    }
    if (planned.release && !is_within(*planned.release, joint)) {
      throw InputError("identify.plan", make_location(file),
                       fmt::format("the release of '{}' leaves its limits", planned.joint),
                       "a plan is not to be edited: doppel identify plan");
    }
  }
}

}  // namespace doppel
