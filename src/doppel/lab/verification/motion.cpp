#include "doppel/lab/verification/motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/physics/contract/step_loop.h"

namespace doppel {
namespace {

constexpr double kMinKinetic = 1e-9;   // J: with less, an energy drift is meaningless
constexpr double kContactLook = 0.01;  // s: interval of contact checks, each of which costs a solution
constexpr double kThrown = 1.0;        // m/s and rad/s
constexpr double kAside = 0.3;  // rad or m: offset of a fall from the start pose, which may be an equilibrium
constexpr double kWay = 0.6;    // rad: length of a move if limits allow it; a tenth of it in m

// Removes everything that dissipates energy or exerts forces.
RobotDescription smooth(RobotDescription robot) {
  for (Joint& joint : robot.joints) {
    joint.dynamics.reset();
    joint.limits.reset();
    if (joint.type == JointType::revolute) joint.type = JointType::continuous;
    if (joint.mimic || joint.type == JointType::prismatic) joint.type = JointType::fixed;
    joint.mimic.reset();
  }
  return robot;
}

ModelInstance smooth(const ModelInstance& robot) {
  Diagnostics diagnostics;  // repeats what was reported for the original robot
  const auto description = std::make_shared<const RobotDescription>(smooth(*robot.description));
  const auto model = std::make_shared<const Model>(
      compile_model(*description, robot.floating() ? BaseKind::floating : BaseKind::fixed, diagnostics));
  InstanceOptions options;
  options.name = robot.name;
  options.X_WR = robot.X_WR;
  options.q0 = model->neutral();
  for (const ModelJoint& joint : model->joints) {
    const int index = robot.model->find_joint(joint.name);
    if (index < 0 || robot.model->joints[static_cast<std::size_t>(index)].nq != joint.nq) continue;
    options.q0.segment(joint.q, joint.nq) =
        robot.q0.segment(robot.model->joints[static_cast<std::size_t>(index)].q, joint.nq);
  }
  CollisionMeshes none;
  ModelInstance out = make_instance(description, model, options, none, diagnostics);
  for (auto& shapes : out.shapes) shapes.clear();
  return out;
}

bool free_joint(const ModelJoint& joint) {
  return joint.scalar() && !joint.mimics();
}

bool leads(const Model& model, int leader) {
  return std::any_of(model.joints.begin(), model.joints.end(),
                     [leader](const ModelJoint& joint) { return joint.mimic_leader == leader; });
}

// q moved by `way` (rad; a tenth of it in m for prismatic joints) towards the middle of each joint's range,
// or, if `way` is negative, away from it within the range. `leaders`: joints that others mimic move too.
Eigen::VectorXd moved(const Model& model, Eigen::VectorXd q, double way, bool leaders) {
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const ModelJoint& joint = model.joints[j];
    if (!free_joint(joint) || (!leaders && leads(model, static_cast<int>(j)))) continue;
    const bool bounded = std::isfinite(joint.lower) && std::isfinite(joint.upper);
    const double middle = bounded ? 0.5 * (joint.lower + joint.upper) : 0.0;
    const double longest = joint.type == JointType::prismatic ? 0.1 * way : way;
    const double side = q[joint.q] > middle ? -1.0 : 1.0;
    double& at = q[joint.q];
    at += side * longest;
    if (bounded) at = std::clamp(at, joint.lower, joint.upper);
  }
  model.apply_mimics(q);
  return q;
}

std::size_t robot_contacts(const std::vector<Contact>& contacts) {
  return static_cast<std::size_t>(std::ranges::count_if(
      contacts, [](const Contact& contact) { return contact.a.instance == 0 || contact.b.instance == 0; }));
}

// The largest move of a quintic within the velocity limits.
Eigen::VectorXd reachable(const Model& model, const Eigen::VectorXd& from, Eigen::VectorXd to) {
  for (const ModelJoint& joint : model.joints) {
    if (!free_joint(joint)) continue;
    const double most = 0.8 * joint.velocity * kMoveTime * 8.0 / 15.0;  // its peak is 15/8 of the mean
    to[joint.q] = from[joint.q] + std::clamp(to[joint.q] - from[joint.q], -most, most);
  }
  model.apply_mimics(to);
  return to;
}

}  // namespace

const char* name_of(MotionKind kind) {
  constexpr std::array kNames{"smooth", "fall", "hold", "move", "path"};
  return kNames[static_cast<std::size_t>(kind)];
}

const char* description_of(MotionKind kind) {
  constexpr std::array kTexts{
      "falls without drives, friction, damping, limits and contacts; mimic and prismatic joints keep their "
      "positions",
      "falls as described, without drives", "drives hold the start pose",
      "drives follow a quintic of 1 s to another pose", "drives follow the given joint trajectory"};
  return kTexts[static_cast<std::size_t>(kind)];
}

Motion::Motion(const MotionSubject& subject, MotionKind kind, const std::string& tool)
    : kind_(kind),
      robot_(kind == MotionKind::smooth ? smooth(subject.robot) : subject.robot),
      others_(subject.others),
      world_(subject.world),
      engine_(subject.engine),
      path_(subject.path) {
  if (kind == MotionKind::smooth) {
    world_.ground = false;
    others_.clear();
  }
  // A robot that is placed on the ground starts there.
  start_ = Eigen::Map<const Eigen::VectorXd>(make_engine(world_.step)->instance(0).q().data(), model().nq);
  tool_ = std::max(0, model().find_link(tool));
  list_coordinates();
  if (kind == MotionKind::smooth) start_ = moved(model(), start_, kAside, true);
  if (kind == MotionKind::fall) start_ = pose_beside(kAside);
  if (kind == MotionKind::move) goal_ = reachable(model(), start_, pose_beside(kWay));
}

Motion::Motion(const MotionSubject& subject, const Motion& plan, const std::string& tool)
    : kind_(plan.kind_),
      robot_(kind_ == MotionKind::smooth ? smooth(subject.robot) : subject.robot),
      others_(plan.others_),
      world_(plan.world_),
      engine_(subject.engine),
      path_(plan.path_),
      start_(plan.start_),
      goal_(plan.goal_) {
  tool_ = std::max(0, model().find_link(tool));
  list_coordinates();
}

std::unique_ptr<Engine> Motion::make_engine(Duration step) const {
  WorldSettings world = world_;
  world.step = step;
  std::vector<ModelInstance> instances{robot_};
  instances.insert(instances.end(), others_.begin(), others_.end());
  Diagnostics diagnostics;  // repeats what was reported before
  return compile_world(engine_, world, std::move(instances), diagnostics)->make_engine();
}

// True if there is a contact on the straight path from the start that does not exist at the start.
bool Motion::touches(Engine& engine, const Eigen::VectorXd& goal) const {
  constexpr int kSamples = 10;
  const std::vector<double> rest(static_cast<std::size_t>(model().nv), 0.0);
  std::vector<Contact> contacts;
  std::size_t before = 0;
  for (int i = 0; i <= kSamples; ++i) {
    Eigen::VectorXd q = start_ + (static_cast<double>(i) / kSamples) * (goal - start_);
    model().apply_mimics(q);
    engine.instance(0).set_state({q.data(), static_cast<std::size_t>(q.size())}, rest);
    engine.contacts(contacts);
    if (i == 0) before = robot_contacts(contacts);
    if (robot_contacts(contacts) > before) return true;
  }
  return false;
}

// A pose about `way` from the start in every joint, on a free path if there is one; a gripper's fingers may
// have to keep their positions.
Eigen::VectorXd Motion::pose_beside(double way) const {
  const std::unique_ptr<Engine> engine = make_engine(world_.step);
  for (const bool leaders : {true, false}) {
    for (const double share : {1.0, -1.0, 0.5, -0.5, 0.25, -0.25}) {
      Eigen::VectorXd pose = moved(model(), start_, share * way, leaders);
      if (!touches(*engine, pose)) return pose;
    }
  }
  return moved(model(), start_, way, true);
}

void Motion::command(Instance robot, double time) const {
  const double s = std::clamp(time / kMoveTime, 0.0, 1.0);
  const double blend = s * s * s * (10.0 + s * (6.0 * s - 15.0));
  for (std::size_t j = 0; j < model().joints.size(); ++j) {
    const ModelJoint& joint = model().joints[j];
    if (free_joint(joint))
      robot.set_target(static_cast<int>(j), start_[joint.q] + blend * (goal_[joint.q] - start_[joint.q]));
  }
}

void Motion::command_path(Instance robot, double time) const {
  const auto next =
      static_cast<std::size_t>(std::ranges::lower_bound(path_.times, time) - path_.times.begin());
  for (std::size_t i = 0; i < path_.joints.size(); ++i) {
    const int joint = model().find_joint(path_.joints[i]);
    if (joint < 0 || !free_joint(model().joints[static_cast<std::size_t>(joint)])) continue;
    const double from =
        next > 0 ? path_.positions[next - 1][i] : start_[model().joints[static_cast<std::size_t>(joint)].q];
    if (next == path_.times.size()) {
      robot.set_target(joint, from);
      continue;
    }
    const double begin = next > 0 ? path_.times[next - 1] : 0.0, way = path_.times[next] - begin;
    const double share = way > 0 ? (time - begin) / way : 1.0;
    robot.set_target(joint, from + share * (path_.positions[next][i] - from));
  }
}

void Motion::list_coordinates() {
  for (std::size_t j = 0; j < model().joints.size(); ++j) {
    const ModelJoint& joint = model().joints[j];
    const int index = static_cast<int>(j);
    if (free_joint(joint)) coordinates_.push_back({joint.name, joint.type == JointType::prismatic, index, 0});
    if (joint.type != JointType::floating) continue;
    constexpr std::array kParts{" x", " y", " z", " turn x", " turn y", " turn z", " turn w"};
    for (int i = 0; i < 7; ++i)
      coordinates_.push_back({model().links[static_cast<std::size_t>(joint.child_link)].name +
                                  kParts[static_cast<std::size_t>(i)],
                              i < 3, index, i});
  }
}

void Motion::sample(const Instance& robot, double time, MotionRecord& out) const {
  const Eigen::Map<const Eigen::VectorXd> q(robot.q().data(), model().nq);
  Eigen::VectorXd x(static_cast<Eigen::Index>(coordinates_.size()));
  for (std::size_t i = 0; i < coordinates_.size(); ++i) {
    const Coordinate& at = coordinates_[i];
    const int index = model().joints[static_cast<std::size_t>(at.joint)].q;
    x[static_cast<Eigen::Index>(i)] = (at.component < 3 ? 1.0 : 2.0) * q[index + at.component];
  }
  out.time.push_back(time);
  out.x.push_back(std::move(x));
  out.tool.push_back(robot.link_pose(tool_).translation());
}

MotionRecord Motion::run(double duration, int fineness, double offset, bool contacts) const {
  const std::unique_ptr<Engine> engine = make_engine(world_.step / fineness);
  Instance robot = engine->instance(0);
  Eigen::VectorXd q = start_;
  for (const ModelJoint& joint : model().joints) {
    if (free_joint(joint)) q[joint.q] += offset;
  }
  std::vector<double> v(static_cast<std::size_t>(model().nv), 0.0);
  const bool floats = std::any_of(model().joints.begin(), model().joints.end(),
                                  [](const ModelJoint& joint) { return joint.type == JointType::floating; });
  if (kind_ == MotionKind::smooth && floats) {
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = kThrown * (i % 3 == 0 ? 1.0 : i % 3 == 1 ? -0.7 : 0.4);
  }
  robot.set_state({q.data(), static_cast<std::size_t>(q.size())}, v);
  if (kind_ != MotionKind::smooth && kind_ != MotionKind::fall) {
    for (std::size_t j = 0; j < model().joints.size(); ++j) {
      if (free_joint(model().joints[j])) robot.set_drive(static_cast<int>(j), DriveMode::position);
    }
  }
  MotionRecord out;
  const double h = to_seconds(world_.step);
  const auto samples = static_cast<int>(std::lround(duration / h));
  const double energy = engine->kinetic_energy() + engine->potential_energy();
  double fastest = 0, drift = 0;
  std::vector<Contact> touching;
  if (contacts) engine->contacts(touching);
  const std::size_t at_start = robot_contacts(touching);
  const int between_looks = std::max(1, static_cast<int>(kContactLook / h));
  sample(robot, 0.0, out);
  for (int i = 1; i <= samples; ++i) {
    if (kind_ == MotionKind::move) command(robot, i * h);
    if (kind_ == MotionKind::path) command_path(robot, i * h);
    out.diverged = run_steps(*engine, {.steps = static_cast<std::uint64_t>(fineness)}) == RunEnd::diverged;
    if (out.diverged) break;
    if (kind_ == MotionKind::smooth) {
      const double kinetic = engine->kinetic_energy();
      fastest = std::max(fastest, kinetic);
      drift = std::max(drift, std::abs(kinetic + engine->potential_energy() - energy));
    }
    sample(robot, i * h, out);
    if (!contacts || out.touches_after || i % between_looks != 0) continue;
    engine->contacts(touching);
    if (robot_contacts(touching) > at_start) out.touches_after = i * h;
  }
  out.energy_drift = fastest > kMinKinetic ? drift / fastest : 0.0;
  return out;
}

std::string choose_tool(const Model& model) {
  static constexpr std::array kNames{"tool0",        "tcp",        "ee_link",           "tool",
                                     "end_effector", "tool_frame", "end_effector_link", "gripper_tcp",
                                     "grasp_link"};
  for (const char* const name : kNames) {
    if (model.find_link(name) >= 0) return name;
  }
  std::size_t best = 0;
  std::vector<int> driven(model.links.size(), 0);
  for (std::size_t i = 1; i < model.links.size(); ++i) {
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(model.links[i].joint)];
    driven[i] = driven[static_cast<std::size_t>(joint.parent_link)] +
                (free_joint(joint) || joint.type == JointType::floating ? 1 : 0);
    if (driven[i] > driven[best]) best = i;
  }
  return model.links[best].name;
}

}  // namespace doppel
