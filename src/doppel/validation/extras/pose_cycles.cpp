#include "doppel/validation/extras/detail/pose_cycles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "doppel/base/math/pose.h"
#include "doppel/robot/ik/task_space.h"
#include "doppel/validation/extras/detail/arm_motion.h"
#include "doppel/validation/extras/detail/twin_touch.h"

namespace doppel {
namespace {

constexpr double kSpeedPart = 0.5;                      // of the speed limits
constexpr double kDwell = 0.8, kMeasured = 0.1;         // s of rest, and its end that is measured
constexpr double kMaxJointWay = 1.5;                    // rad or m between poses: more is another branch
constexpr double kMaxSimulated = 300;                   // s of all cycles
constexpr int kEqualCycles = 3;                         // of an arm in which nothing varies
constexpr double kApproach = 0.2, kMaxApproach = 0.05;  // of the edge, m: the way from one direction
constexpr std::size_t kCentres = 24;
constexpr double kInside = 0.8;  // of half a diagonal: a tenth of the diagonal from the corners

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

// The test poses, and three places on each straight way of the joints between them.
bool is_free(TwinTouch& touch, const Model& model, const TestPlane& plane) {
  for (std::size_t i = 0; i < kTestPoses; ++i) {
    const Eigen::VectorXd &q = plane.q[i], &before = plane.q[(i + kTestPoses - 1) % kTestPoses];
    for (const double share : {1.0, 0.75, 0.5, 0.25})
      if (!touch.is_free(model, before + share * (q - before))) return false;
  }
  return true;
}

Pose commanded_pose(const ExtraArm& arm, const Eigen::VectorXd& q) {
  Data data(arm.model());
  forward_kinematics(arm.model(), data, q);
  return data.X_WL.front().inverse() * data.X_WL[static_cast<std::size_t>(arm.chain().tip_link)];
}

// A motion to a pose, and the tool at the end of the rest after it.
std::optional<PoseApproach> approach(ArmMotion& motion, const Eigen::VectorXd& start,
                                     const Eigen::VectorXd& end, double seconds, const Pose& X_RC,
                                     const std::function<void()>& every_step = {}) {
  PoseApproach out;
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), angles = Eigen::Vector3d::Zero();
  double count = 0;
  motion.begin_run();
  const auto sample = [&](double time) {
    const Pose X_RT = motion.real_tool();
    out.time.push_back(time);
    out.positions.emplace_back(X_RT.translation());
    if (time < seconds + kDwell - kMeasured) return;
    position += X_RT.translation();
    angles += rpy_from_rotation(X_RC.linear().transpose() * X_RT.linear());
    ++count;
  };
  if (!motion.run(ArmMotion::straight(start, end, seconds), seconds, kDwell, sample, every_step) ||
      count == 0)
    return std::nullopt;
  out.attained = {position / count, angles / count};
  return out;
}

class CycleRun {
 public:
  CycleRun(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane, PoseCycles& out)
      : plane_(plane), motion_(context, arm), out_(out) {
    for (std::size_t i = 0; i < kTestPoses; ++i) {
      variables_[i] = arm.chain().variables_of(arm.model(), plane.q[i]);
      commanded_[i] = commanded_pose(arm, plane.q[i]);
      out.commanded[i].position = commanded_[i].translation();
    }
    out.servos = motion_.errors().text();
    out.varies = motion_.errors().any() ||
                 std::ranges::any_of(arm.model().joints, [](const auto& one) { return one.friction > 0; });
  }

  std::string run(const CheckContext& context, int cycles) {
    if (std::string why = motion_.begin(plane_.q.back()); !why.empty()) return why;
    for (std::size_t i = 0; i < kTestPoses; ++i)
      out_.motion_time =
          std::max(out_.motion_time, motion_.motion_time(variables_[before(i)], variables_[i], kSpeedPart));
    out_.cycle_time = kTestPoses * (out_.motion_time + kDwell);
    cycles =
        out_.varies ? std::clamp(static_cast<int>(kMaxSimulated / out_.cycle_time), 2, cycles) : kEqualCycles;
    for (int cycle = 0; cycle <= cycles; ++cycle) {
      out_.power_time.clear();
      out_.power.clear();
      cycle_begin_ = to_seconds(motion_.machine().twin().now());
      for (std::size_t i = 0; i < kTestPoses; ++i) {
        auto one = approach(motion_, variables_[before(i)], variables_[i], out_.motion_time, commanded_[i],
                            [&] { add_power(cycle > 0); });
        if (!one) return "the physics diverges on the way to a test pose";
        if (cycle > 0) out_.approaches[i].push_back(std::move(*one));
      }
      context.report(static_cast<double>(cycle + 1) / (cycles + 1));
    }
    out_.energy /= cycles;
    out_.mean_power = out_.energy / out_.cycle_time;
    return "";
  }

 private:
  [[nodiscard]] static std::size_t before(std::size_t pose) { return (pose + kTestPoses - 1) % kTestPoses; }

  void add_power(bool counts) {
    if (!counts) return;
    MachineRun& machine = motion_.machine();
    double power = 0;
    for (const int joint : motion_.joints())
      power += std::max(0.0, machine.effort(joint) * machine.speed(joint));
    out_.energy += power * to_seconds(machine.twin().step_size());
    out_.peak_power = std::max(out_.peak_power, power);
    out_.power_time.push_back(to_seconds(machine.twin().now()) - cycle_begin_);
    out_.power.push_back(power);
  }

  const TestPlane& plane_;
  ArmMotion motion_;
  PoseCycles& out_;
  std::array<Eigen::VectorXd, kTestPoses> variables_;
  std::array<Pose, kTestPoses> commanded_;
  double cycle_begin_ = 0;
};

// The places from which a pose is approached: on the root's axes, on the side of the cube's centre.
class ApproachFinder {
 public:
  ApproachFinder(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane)
      : arm_(arm),
        plane_(plane),
        touch_(context),
        reach_(arm.reach()),
        task_(plane.orientation ? find_task_space(arm.chain()).task : IkTask::position) {}

  std::optional<Eigen::VectorXd> begin(std::size_t pose, Eigen::Index axis) {
    Data data(arm_.model());
    forward_kinematics(arm_.model(), data, plane_.q[pose]);
    ReachQuery query;
    query.X_WT = data.X_WL[static_cast<std::size_t>(arm_.chain().tip_link)];
    const double to_centre = plane_.centre[axis] - query.X_WT.translation()[axis];
    const double way = std::min(kApproach * plane_.edge, kMaxApproach);
    query.X_WT.translation()[axis] += to_centre < -1e-9 ? -way : way;
    query.task = task_;
    query.q = plane_.q[pose];
    const ReachAnswer answer = reach_.answer(query);
    if (!answer.solved) return std::nullopt;
    const Eigen::VectorXd& q = answer.branches.front().q;
    if ((q - plane_.q[pose]).cwiseAbs().maxCoeff() > kMaxJointWay || !touch_.is_free(arm_.model(), q))
      return std::nullopt;
    return q;
  }

 private:
  const ExtraArm& arm_;
  const TestPlane& plane_;
  TwinTouch touch_;
  ArmReach reach_;
  IkTask task_;
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
        if (!plane || !is_free(touch, arm.model(), *plane)) continue;
        plane->orientation = task != IkTask::position;
        return plane;
      }
    }
  }
  return std::nullopt;
}

std::string TestPlane::text() const {
  return fmt::format("cube of {:.3f} m around ({:.3f}, {:.3f}, {:.3f})", edge, centre.x(), centre.y(),
                     centre.z());
}

std::shared_ptr<const std::optional<TestPlane>> shared_test_plane(const CheckContext& context,
                                                                  const ExtraArm& arm) {
  return shared_result<std::optional<TestPlane>>(context, "test plane of " + arm.name(),
                                                 [&] { return find_test_plane(context, arm); });
}

std::string run_pose_directions(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane,
                                int cycles, PoseDirections& out) {
  ApproachFinder finder(context, arm, plane);
  ArmMotion motion(context, arm);
  const bool varies = motion.errors().any() || std::ranges::any_of(arm.model().joints, [](const auto& one) {
                        return one.friction > 0;
                      });
  for (std::size_t i = 0; i < kDirectionPoses.size(); ++i) {
    const std::size_t pose = kDirectionPoses[i];
    const Pose X_RC = commanded_pose(arm, plane.q[pose]);
    const Eigen::VectorXd end = arm.chain().variables_of(arm.model(), plane.q[pose]);
    out.commanded[i].position = X_RC.translation();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const auto q = finder.begin(pose, axis);
      if (!q) continue;
      if (std::string why = motion.begin(*q); !why.empty()) return why;
      const Eigen::VectorXd start = arm.chain().variables_of(arm.model(), *q);
      const double seconds = motion.motion_time(start, end, kSpeedPart);
      constexpr double kParts = 9;  // poses by directions
      const int count =
          varies ? std::clamp(static_cast<int>(kMaxSimulated / kParts / (2 * seconds + kDwell)), 2, cycles)
                 : kEqualCycles;
      std::vector<MeasuredPose> attained;
      for (int cycle = 0; cycle <= count; ++cycle) {
        const auto one = approach(motion, start, end, seconds, X_RC);
        if (!one || !motion.run(ArmMotion::straight(end, start, seconds), seconds, 0, {}))
          return "the physics diverges at a test pose";
        if (cycle > 0) attained.push_back(one->attained);  // the first one begins elsewhere
      }
      out.attained[i].push_back(std::move(attained));
      context.report(static_cast<double>(3 * static_cast<int>(i) + static_cast<int>(axis) + 1) / kParts);
    }
  }
  return "";
}

std::string run_pose_cycles(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane,
                            int cycles, PoseCycles& out) {
  return CycleRun(context, arm, plane, out).run(context, cycles);
}

}  // namespace doppel
