#pragma once
// A joint_trajectory_controller "arm" in a controller manager with fake hardware, and a client that uses the
// interfaces of external clients: topics from a node, the action through an edge.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "doppel/control/controllers/test/action_rig.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {

struct JtcOptions {
  std::vector<FakeJoint> joints = {{"a"}, {"b"}, {"c"}};
  std::vector<std::string> commands = {kPosition};
  std::vector<std::string> states = {kPosition, kVelocity};
  std::string more;          // YAML: "constraints: {goal_time: 1.0}, cmd_timeout: 2.0"
  std::string listed;        // of the parameter joints, if not all
  double time_constant = 0;  // of the hardware
  bool enforce_limits = false;
  bool start = true;  // load, configure and activate
  std::vector<InterfaceDescription> more_commands, more_states;
  CommandGuard* guard = nullptr;
};

inline const std::vector<std::string> kJoints = {"a", "b", "c"};  // of JtcOptions, unless given

inline JtcOptions options_of(std::vector<std::string> commands,
                             std::vector<std::string> states = {kPosition, kVelocity},
                             std::string more = "") {
  JtcOptions options;
  options.commands = std::move(commands);
  options.states = std::move(states);
  options.more = std::move(more);
  return options;
}

inline std::string yaml_list(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  return "[" + all + "]";
}

inline std::string jtc_yaml(const JtcOptions& options) {
  std::vector<std::string> joints;
  for (const FakeJoint& joint : options.joints) joints.push_back(joint.name);
  return "controller_manager:\n  ros__parameters:\n"
         "    arm: {type: joint_trajectory_controller/JointTrajectoryController}\n"
         "arm:\n  ros__parameters: {joints: " +
         (options.listed.empty() ? yaml_list(joints) : options.listed) +
         ", command_interfaces: " + yaml_list(options.commands) +
         ", state_interfaces: " + yaml_list(options.states) +
         (options.more.empty() ? "" : ", " + options.more) + "}\n";
}

inline std::vector<std::string> without_repeats(std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

inline FakeHardwareOptions jtc_hardware(const JtcOptions& options) {
  FakeHardwareOptions hardware;
  for (const FakeJoint& joint : options.joints) {
    (joint.mimics.empty() ? hardware.joints : hardware.state_only_joints).push_back(joint.name);
  }
  hardware.commands = without_repeats(options.commands);
  hardware.states = without_repeats(options.states);
  hardware.more_commands = options.more_commands;
  hardware.more_states = options.more_states;
  hardware.time_constant = options.time_constant;
  return hardware;
}

using FollowJointTrajectory = control_msgs::action::FollowJointTrajectory;
using trajectory_msgs::msg::JointTrajectory;
using trajectory_msgs::msg::JointTrajectoryPoint;

inline JointTrajectoryPoint point(double time_s, std::vector<double> positions,
                                  std::vector<double> velocities = {}, std::vector<double> accelerations = {},
                                  std::vector<double> effort = {}) {
  return {std::move(positions), std::move(velocities), std::move(accelerations), std::move(effort),
          to_duration_msg(from_seconds(time_s))};
}

inline JointTrajectory trajectory(std::vector<std::string> joints, std::vector<JointTrajectoryPoint> points,
                                  double stamp_s = 0) {
  JointTrajectory message;
  message.header.stamp = to_time_msg(time_from_seconds(stamp_s));
  message.joint_names = std::move(joints);
  message.points = std::move(points);
  return message;
}

class JtcRig : public ActionRig<FollowJointTrajectory> {
 public:
  explicit JtcRig(const JtcOptions& options = {})
      : ActionRig(jtc_yaml(options), "/arm/follow_joint_trajectory", options.joints, jtc_hardware(options),
                  options.enforce_limits, options.guard) {
    if (options.start) start();
  }

  void start() {
    manager->load("arm");
    require(manager->configure("arm"));
    require(activate());
    run(1);
  }
  Status activate() { return switch_to({"arm"}); }
  Status deactivate() { return switch_to({}, {"arm"}); }

  using ManagerRig::say;
  void say(const JointTrajectory& message) { say("/arm/joint_trajectory", message); }
  using ActionRig::send;
  std::size_t send(const JointTrajectory& message) {
    FollowJointTrajectory::Goal goal;
    goal.trajectory = message;
    return send(goal);
  }
  Status set_parameter(const std::string& name, const ParameterValue& value) {
    return ActionRig::set_parameter("/arm", name, value);
  }
};

}  // namespace doppel
