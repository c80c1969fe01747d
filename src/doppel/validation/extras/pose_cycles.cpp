#include "doppel/validation/extras/detail/pose_cycles.h"

#include <algorithm>
#include <cmath>

#include "doppel/base/math/pose.h"
#include "doppel/robot/ik/task_space.h"
#include "doppel/validation/extras/detail/joint_motion.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr double kSpeedPart = 0.5;               // of the speed limits
constexpr double kPeakOfQuintic = 1.875;         // of the mean speed
constexpr double kMinMotion = 0.4;               // s
constexpr double kDwell = 0.8, kMeasured = 0.1;  // s of rest, and its end that is measured
constexpr double kCommandStep = 0.01;            // s between points
constexpr double kMaxJointWay = 1.5;             // rad or m between poses: more is another branch
constexpr double kMaxSimulated = 300;            // s of all cycles
constexpr std::size_t kCentres = 24;
constexpr double kInside = 0.8;  // of half a diagonal: a tenth of the diagonal from the corners

double quintic(double share) {
  return share * share * share * (10 + share * (6 * share - 15));
}

std::optional<TestPlane> plane_at(ArmReach& reach, const ExtraArm& arm, IkTask task, const ArmPlace& place,
                                  double edge) {
  Data data(arm.model());
  forward_kinematics(arm.model(), data, place.q);
  const Pose& X_WT = data.X_WL[static_cast<std::size_t>(arm.chain().tip_link)];
  const double half = 0.5 * edge * kInside;
  const std::array<Eigen::Vector3d, kTestPoses> offsets = {
      Eigen::Vector3d::Zero(), Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, -1, 1),
      Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(-1, 1, -1)};
  TestPlane out{edge, X_WT.translation(), {}, true};
  Eigen::VectorXd q = place.q;
  for (std::size_t i = 0; i < kTestPoses; ++i) {
    ReachQuery query;
    query.X_WT = X_WT;
    query.X_WT.translation() += half * offsets[i];
    query.task = task;
    query.q = q;
    query.attempts = 32;
    const ReachAnswer answer = reach.answer(query);
    if (!answer.solved) return std::nullopt;
    out.q[i] = answer.branches.front().q;
    if (i > 0 && (out.q[i] - out.q[i - 1]).cwiseAbs().maxCoeff() > kMaxJointWay) return std::nullopt;
    q = out.q[i];
  }
  return out;
}

// Configurations in which the twin's robot touches nothing that it does not touch at its start.
class TwinTouch {
 public:
  explicit TwinTouch(const CheckContext& context) : machine_(context, no_controllers()) { start_ = pairs(); }

  bool is_free(const Model& model, const Eigen::VectorXd& q) {
    Instance robot = machine_.twin().robot().instance();
    std::vector<double> position(robot.q().begin(), robot.q().end());
    const std::vector<double> rest(robot.v().size(), 0.0);
    for (const ModelJoint& joint : model.joints) {
      const int twin = robot.model().find_joint(joint.name);
      if (joint.scalar() && twin >= 0)
        position[static_cast<std::size_t>(robot.model().joints[static_cast<std::size_t>(twin)].q)] =
            q[joint.q];
    }
    robot.set_state(position, rest);
    return std::ranges::all_of(
        pairs(), [&](const Pair& pair) { return std::ranges::find(start_, pair) != start_.end(); });
  }

  // The test poses, and three places on each straight way of the joints between them.
  bool is_free(const Model& model, const TestPlane& plane) {
    for (std::size_t i = 0; i < kTestPoses; ++i) {
      const Eigen::VectorXd &q = plane.q[i], &before = plane.q[(i + kTestPoses - 1) % kTestPoses];
      for (const double share : {1.0, 0.75, 0.5, 0.25})
        if (!is_free(model, before + share * (q - before))) return false;
    }
    return true;
  }

 private:
  using Pair = std::pair<BodyId, BodyId>;
  static MachineOptions no_controllers() {
    MachineOptions out;
    out.start_controllers = false;
    return out;
  }
  std::vector<Pair> pairs() {
    std::vector<Contact> contacts;
    machine_.twin().engine().contacts(contacts);
    std::vector<Pair> out;
    for (const Contact& contact : contacts) out.emplace_back(contact.a, contact.b);
    return out;
  }

  MachineRun machine_;
  std::vector<Pair> start_;
};

class CycleRun {
 public:
  CycleRun(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane, PoseCycles& out)
      : arm_(arm), plane_(plane), machine_(context, options_of(arm)), out_(out) {
    for (int k = 0; k < arm.chain().size(); ++k) names_.push_back(arm.joint(k).name);
    for (std::size_t i = 0; i < kTestPoses; ++i) {
      variables_[i] = arm.chain().variables_of(arm.model(), plane.q[i]);
      Data data(arm.model());
      forward_kinematics(arm.model(), data, plane.q[i]);
      commanded_[i] = data.X_WL.front().inverse() * data.X_WL[static_cast<std::size_t>(arm.chain().tip_link)];
      out.commanded[i].position = commanded_[i].translation();
    }
    base_ = std::max(0, machine_.model().find_link(arm.model().links.front().name));
    tip_ = machine_.model().find_link(arm.model().links[static_cast<std::size_t>(arm.chain().tip_link)].name);
    for (const std::string& name : names_) twin_joints_.push_back(machine_.model().find_joint(name));
  }

  std::string run(const CheckContext& context, int cycles) {
    JointMotion motion(machine_, names_);
    if (!motion.missing().empty()) return motion.missing() + " has no position command on a topic";
    if (const Status placed = machine_.place(posed_joints(arm_.model(), plane_.q.back())); !placed)
      return "the test poses cannot be taken: " + placed.why();
    machine_.run(0.5);
    out_.motion_time = motion_time();
    out_.cycle_time = kTestPoses * (out_.motion_time + kDwell);
    cycles = std::clamp(static_cast<int>(kMaxSimulated / out_.cycle_time), 2, cycles);
    for (const ModelJoint& joint : arm_.model().joints) out_.varies = out_.varies || joint.friction > 0;
    for (int cycle = 0; cycle <= cycles; ++cycle) {
      out_.power_time.clear();
      out_.power.clear();
      cycle_begin_ = to_seconds(machine_.twin().now());
      for (std::size_t i = 0; i < kTestPoses; ++i) {
        auto approach = approach_to(motion, i, cycle > 0);
        if (!approach) return "the physics diverges on the way to a test pose";
        if (cycle > 0) out_.approaches[i].push_back(std::move(*approach));
      }
      context.report(static_cast<double>(cycle + 1) / (cycles + 1));
    }
    out_.energy /= cycles;
    out_.mean_power = out_.energy / out_.cycle_time;
    return "";
  }

 private:
  static MachineOptions options_of(const ExtraArm& arm) {
    MachineOptions out;
    out.payload = arm.payload() > 0;
    return out;
  }

  [[nodiscard]] std::size_t before(std::size_t pose) const { return (pose + kTestPoses - 1) % kTestPoses; }

  [[nodiscard]] double motion_time() const {
    double out = kMinMotion;
    for (std::size_t i = 0; i < kTestPoses; ++i) {
      const Eigen::VectorXd way = (variables_[i] - variables_[before(i)]).cwiseAbs();
      for (int k = 0; k < arm_.chain().size(); ++k) {
        if (std::isfinite(arm_.joint(k).velocity))
          out = std::max(out, kPeakOfQuintic * way[k] / (kSpeedPart * arm_.joint(k).velocity));
      }
    }
    return out;
  }

  std::optional<PoseApproach> approach_to(JointMotion& motion, std::size_t pose, bool counts) {
    const Eigen::VectorXd &start = variables_[before(pose)], &end = variables_[pose];
    const auto course = [&](double time) -> Eigen::VectorXd {
      return start + quintic(std::clamp(time / out_.motion_time, 0.0, 1.0)) * (end - start);
    };
    const double step = to_seconds(machine_.twin().step_size());
    PoseApproach out;
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), angles = Eigen::Vector3d::Zero();
    double count = 0;
    const bool ran = motion.run(course, out_.motion_time, kCommandStep, kDwell, [&](double time) {
      if (counts) add_power(step);
      if (time < 0) return;
      const Pose X_BT = tool();
      out.time.push_back(time);
      out.positions.emplace_back(X_BT.translation());
      if (time < out_.motion_time + kDwell - kMeasured) return;
      position += X_BT.translation();
      angles += rpy_from_rotation(commanded_[pose].linear().transpose() * X_BT.linear());
      ++count;
    });
    if (!ran || count == 0) return std::nullopt;
    out.attained = {position / count, angles / count};
    return out;
  }

  [[nodiscard]] Pose tool() {
    const Instance& robot = machine_.twin().robot().instance();
    return robot.link_pose(base_).inverse() * robot.link_pose(tip_);
  }

  void add_power(double step) {
    double power = 0;
    for (const int joint : twin_joints_)
      power += std::max(0.0, machine_.effort(joint) * machine_.speed(joint));
    out_.energy += power * step;
    out_.peak_power = std::max(out_.peak_power, power);
    out_.power_time.push_back(to_seconds(machine_.twin().now()) - cycle_begin_);
    out_.power.push_back(power);
  }

  const ExtraArm& arm_;
  const TestPlane& plane_;
  MachineRun machine_;
  PoseCycles& out_;
  std::vector<std::string> names_;
  std::vector<int> twin_joints_;
  std::array<Eigen::VectorXd, kTestPoses> variables_;
  std::array<Pose, kTestPoses> commanded_;
  int base_ = 0, tip_ = 0;
  double cycle_begin_ = 0;
};

}  // namespace

std::optional<TestPlane> find_test_plane(const CheckContext& context, const ExtraArm& arm) {
  std::vector<ArmPlace> places = arm.places(context.amount(100, 200, 400), context.seed);
  if (places.empty()) return std::nullopt;
  const double farthest = std::ranges::max_element(places, {}, &ArmPlace::distance)->distance;
  constexpr double kMiddle = 0.6;  // of the reach
  std::ranges::stable_sort(
      places, {}, [&](const ArmPlace& place) { return std::abs(place.distance - kMiddle * farthest); });
  if (places.size() > kCentres) places.resize(kCentres);
  ArmReach reach = arm.reach();
  TwinTouch touch(context);
  for (const IkTask task : {find_task_space(arm.chain()).task, IkTask::position}) {
    for (const double share : {0.8, 0.65, 0.5, 0.4, 0.3, 0.2, 0.1}) {
      for (const ArmPlace& place : places) {
        auto plane = plane_at(reach, arm, task, place, share * farthest);
        if (!plane || !touch.is_free(arm.model(), *plane)) continue;
        plane->orientation = task != IkTask::position;
        return plane;
      }
    }
  }
  return std::nullopt;
}

std::string run_pose_cycles(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane,
                            int cycles, PoseCycles& out) {
  return CycleRun(context, arm, plane, out).run(context, cycles);
}

}  // namespace doppel
