#include "doppel/validation/extras/detail/joint_stop.h"

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

constexpr double kMaxTime = 2.0, kPiece = 0.05;  // s
constexpr double kRest = 0.001;                  // rad/s or m/s
constexpr double kAtLimit = 0.002;               // rad or m

void set_moving(MachineRun& machine, int joint, double speed) {
  Instance robot = machine.twin().robot().instance();
  const std::vector<double> q(robot.q().begin(), robot.q().end());
  std::vector<double> v(robot.v().size(), 0.0);
  v[static_cast<std::size_t>(machine.joint(joint).v)] = speed;
  for (const ModelJoint& follower : machine.model().joints) {
    if (follower.mimic_leader == joint)
      v[static_cast<std::size_t>(follower.v)] = follower.mimic_multiplier * speed;
  }
  robot.set_state(q, v);
}

void take_power(MachineRun& machine) {
  Instance robot = machine.twin().robot().instance();
  for (const std::string& name : machine.model().driven_joint_names())
    robot.set_drive(machine.model().find_joint(name), DriveMode::passive);
}

bool rests(const MachineRun& machine) {
  return std::ranges::all_of(machine.joints(),
                             [&](int joint) { return std::abs(machine.speed(joint)) < kRest; });
}

}  // namespace

std::optional<JointStop> stop_joint(MachineRun& machine, int joint, int link, double speed,
                                    StopCategory category) {
  JointStop out;
  std::vector<double> speeds;
  const double begin = to_seconds(machine.twin().now());
  const Instance& robot = machine.twin().robot().instance();
  set_moving(machine, joint, speed);
  const Eigen::Vector3d tool = robot.link_pose(link).translation();
  const auto sample = [&] {
    out.time.push_back(to_seconds(machine.twin().now()) - begin);
    out.position.push_back(machine.position(joint));
    speeds.push_back(machine.speed(joint));
    out.tool_way = std::max(out.tool_way, (robot.link_pose(link).translation() - tool).norm());
  };
  sample();
  machine.twin().robot().controller_manager().stop("validation");
  if (category == StopCategory::off) take_power(machine);
  bool is_off = category == StopCategory::off;
  for (int i = 0; i * kPiece < kMaxTime; ++i) {
    if (!machine.run(kPiece, sample)) return std::nullopt;
    if (!rests(machine)) continue;
    if (is_off || category == StopCategory::brake_and_hold) break;
    take_power(machine);
    is_off = true;
  }
  StopOptions options;
  options.threshold = kRest;
  const auto figures = stop_figures(out.time, out.position, speeds, options);
  if (!figures) return std::nullopt;
  out.figures = *figures;
  const ModelJoint& about = machine.joint(joint);
  out.ends_at_limit =
      out.position.back() < about.lower + kAtLimit || out.position.back() > about.upper - kAtLimit;
  return out;
}

}  // namespace doppel
