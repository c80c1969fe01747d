#include "doppel/validation/extras/kinematics_extra.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/semantics/self_collision.h"
#include "doppel/validation/extras/detail/extra_arm.h"
#include "doppel/validation/motions/machine_run.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

// These bound errors of doppel itself, not of the machine: a larger one is a fault of the program.
constexpr double kSame = 1e-9;          // m, rad: what two ways to compute one thing may differ by
constexpr double kRoundTrip = 1e-4;     // m
constexpr double kRoundAngle = 1e-3;    // rad
constexpr double kDifference = 1e-5;    // rad, m: half of the span of central differences
constexpr double kSameJacobian = 1e-8;  // m per rad: differences end by rounding

struct Worst {
  double value = 0;
  Eigen::VectorXd q;
  std::string link;

  void add(double other, const Eigen::VectorXd& where, const std::string& name = "") {
    if (other <= value && q.size() > 0) return;
    *this = {other, where, name};
  }
};

class KinematicsJudge {
 public:
  KinematicsJudge(const CheckContext& context, CheckResult& out)
      : context_(context), model_(*context.subject.model), out_(out) {
    std::uint64_t state = context.seed;
    const int count = context.amount(20, 100, 500);
    for (int i = 0; i < count; ++i) configurations_.push_back(random_configuration(model_, state));
  }

  void run() {
    judge_engine();
    context_.report(0.2);
    judge_jacobian();
    context_.report(0.4);
    const std::vector<ExtraArm> arms = extra_arms(context_);
    for (const ExtraArm& arm : arms) judge_round_trip(arm);
    if (arms.empty()) out_.notes.push_back("no round trip: " + no_arm_reason(context_));
    out_.summary = fmt::format(
        "engine {:.1e} m, Jacobian {:.1e} (limits {:.0e}, {:.0e}){}", engine_.value, jacobian_.value, kSame,
        kSameJacobian,
        arms.empty() ? "" : fmt::format(", round trip {:.1e} m (limit {:.0e} m)", round_trip_, kRoundTrip));
  }

 private:
  void add(const std::string& subject, const std::string& name, const Worst& worst, const std::string& unit,
           double limit) {
    out_.metrics.push_back({name, subject, worst.value, unit, limit});
    CheckItem item;
    item.subject = subject;
    item.verdict = worst.value > limit ? Verdict::failed : Verdict::passed;
    item.message =
        fmt::format("{}: at most {:.2e} {} (limit {:.0e} {})", name, worst.value, unit, limit, unit);
    if (item.verdict == Verdict::failed) {
      item.fix = "this is a fault of doppel: please report it with the description";
      item.poses.push_back({"the largest difference", posed_joints(model_, worst.q), {}});
      if (!worst.link.empty()) item.poses.back().links.push_back(worst.link);
    }
    out_.add(std::move(item));
  }

  // Each link in the base link, by the model and by the engine.
  void judge_engine() {
    MachineOptions options;
    options.start_controllers = false;
    MachineRun machine(context_, options);
    Instance robot = machine.twin().robot().instance();
    const int base = machine.model().find_link(model_.links.front().name);
    Data data(model_);
    for (const Eigen::VectorXd& q : configurations_) {
      place(robot, q);
      forward_kinematics(model_, data, q);
      const Pose X_BW = robot.link_pose(std::max(base, 0)).inverse();
      for (std::size_t i = 0; i < model_.links.size(); ++i) {
        const int link = machine.model().find_link(model_.links[i].name);
        if (link < 0) continue;
        const Pose X_BL = X_BW * robot.link_pose(link);
        const Pose difference = (data.X_WL.front().inverse() * data.X_WL[i]).inverse() * X_BL;
        const double angle = Eigen::AngleAxisd(difference.linear()).angle();
        engine_.add(std::max(difference.translation().norm(), angle), q, model_.links[i].name);
      }
    }
    add("", "forward kinematics against the engine", engine_, "m", kSame);
  }

  // A whole state of the twin's robot, whose model may have a floating base.
  void place(Instance& robot, const Eigen::VectorXd& q) const {
    std::vector<double> position(robot.q().begin(), robot.q().end());
    const std::vector<double> rest(robot.v().size(), 0.0);
    for (const ModelJoint& joint : model_.joints) {
      const int twin = robot.model().find_joint(joint.name);
      if (!joint.scalar() || twin < 0) continue;
      const ModelJoint& placed = robot.model().joints[static_cast<std::size_t>(twin)];
      position[static_cast<std::size_t>(placed.q)] = q[joint.q];
    }
    robot.set_state(position, rest);
  }

  // The last link of each branch: its rates by all joints above it, against central differences.
  void judge_jacobian() {
    std::vector<bool> is_parent(model_.links.size(), false);
    for (const ModelJoint& joint : model_.joints)
      is_parent[static_cast<std::size_t>(joint.parent_link)] = true;
    Data data(model_), low(model_), high(model_);
    Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model_.nv);
    for (const Eigen::VectorXd& q : configurations_) {
      forward_kinematics(model_, data, q);
      for (std::size_t link = 0; link < model_.links.size(); ++link) {
        if (is_parent[link]) continue;
        jacobian(model_, data, static_cast<int>(link), Eigen::Vector3d::Zero(), J);
        compare(J, static_cast<int>(link), q, low, high);
      }
    }
    add("", "Jacobian against central differences", jacobian_, "", kSameJacobian);
  }

  void compare(const Eigen::Matrix<double, 6, Eigen::Dynamic>& J, int link, const Eigen::VectorXd& q,
               Data& low, Data& high) {
    const auto index = static_cast<std::size_t>(link);
    for (const ModelJoint& joint : model_.joints) {
      if (!joint.scalar()) continue;
      Eigen::VectorXd moved = q;
      moved[joint.q] = q[joint.q] - kDifference;
      forward_kinematics(model_, low, moved);
      moved[joint.q] = q[joint.q] + kDifference;
      forward_kinematics(model_, high, moved);
      const Eigen::AngleAxisd turn(high.X_WL[index].linear() * low.X_WL[index].linear().transpose());
      Eigen::Matrix<double, 6, 1> rate;
      rate << turn.angle() * turn.axis(), high.X_WL[index].translation() - low.X_WL[index].translation();
      rate /= 2 * kDifference;
      jacobian_.add((J.col(joint.v) - rate).cwiseAbs().maxCoeff(), q, model_.links[index].name);
    }
  }

  // FK(IK(FK(q))) against FK(q), by as much of a pose as the arm sets.
  void judge_round_trip(const ExtraArm& arm) {
    ArmReach reach = arm.reach();
    Data data(model_);
    Worst position, angle;
    int missed = 0;
    const std::vector<ArmPlace> places = arm.places(context_.amount(20, 200, 1000), context_.seed);
    for (const ArmPlace& place : places) {
      forward_kinematics(model_, data, place.q);
      ReachQuery query;
      query.X_WT = data.X_WL[static_cast<std::size_t>(arm.chain().tip_link)];
      const ReachAnswer answer = reach.answer(query);
      if (!answer.solved) {
        ++missed;
        continue;
      }
      forward_kinematics(model_, data, answer.branches.front().q);
      const Pose& attained = data.X_WL[static_cast<std::size_t>(arm.chain().tip_link)];
      position.add((attained.translation() - query.X_WT.translation()).norm(), place.q);
      angle.add(answer.branches.front().solution.rotation_error, place.q);
    }
    if (missed > 0)
      out_.notes.push_back(fmt::format("{}: {} of {} poses are not found, which test T1 judges", arm.name(),
                                       missed, places.size()));
    round_trip_ = std::max(round_trip_, position.value);
    add(arm.name(), "position after a round trip", position, "m", kRoundTrip);
    add(arm.name(), "angle after a round trip", angle, "rad", kRoundAngle);
  }

  const CheckContext& context_;
  const Model& model_;
  CheckResult& out_;
  std::vector<Eigen::VectorXd> configurations_;
  Worst engine_, jacobian_;
  double round_trip_ = 0;
};

}  // namespace

CheckResult check_kinematics(const CheckContext& context) {
  if (context.subject.model->scalar_joint_names().empty()) return not_applicable("X1", "no joint moves");
  CheckResult out = begin_result("X1");
  KinematicsJudge(context, out).run();
  return out;
}

}  // namespace doppel
