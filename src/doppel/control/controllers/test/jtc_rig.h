#pragma once
// A joint_trajectory_controller "arm" in a controller manager with fake hardware, and a client that uses the
// interfaces of external clients: topics from a node, the action through an edge.

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/bus/action_server.h"
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

// All messages of one type on one topic.
template <class M>
struct Listener {
  Listener(Bus& bus, const std::string& topic) : node(bus, "/listener") {
    node.subscribe<M>(topic, [this](const M& message) { messages.push_back(message); });
  }
  Node node;
  std::vector<M> messages;
};

class JtcRig : public ManagerRig {
 public:
  explicit JtcRig(const JtcOptions& options = {})
      : ManagerRig(jtc_yaml(options), options.joints, jtc_hardware(options), manager_options(options)),
        speaker_(bus, "/speaker"),
        trajectories_(speaker_.advertise<JointTrajectory>("/arm/joint_trajectory")),
        edge_(bus.attach("client")) {
    if (options.start) start();
  }
  ~JtcRig() { edge_.reset(); }

  void start() {
    manager->load("arm");
    require(manager->configure("arm"));
    require(activate());
    run(1);
  }
  Status activate() { return switch_to({"arm"}, {}); }
  Status deactivate() { return switch_to({}, {"arm"}); }
  void run_for(double seconds) {
    run(static_cast<int>(std::lround(seconds / to_seconds(manager->period()))));
  }
  [[nodiscard]] double time() const { return to_seconds(now); }

  void say(const JointTrajectory& message) { trajectories_.publish(message, now); }
  template <class M>
  void say(const std::string& topic, const M& message) {
    speaker_.advertise<M>(topic).publish(message, now);
  }

  // -- the action
  struct Answer {
    std::optional<bool> accepted;
    std::optional<double> finished_at;  // s
    GoalStatus status = GoalStatus::unknown;
    FollowJointTrajectory::Result result;
  };
  // The goal's index in `answers`.
  std::size_t send(const FollowJointTrajectory::Goal& goal) {
    const std::size_t index = answers.size();
    answers.emplace_back();
    SendGoal<FollowJointTrajectory>::Request request;
    request.goal_id.uuid = id_of(index);
    request.goal = goal;
    call<SendGoal<FollowJointTrajectory>>(
        "send_goal", request, [this, index](const auto& r) { answers[index].accepted = r.accepted; });
    if (!answers[index].accepted.value_or(false)) return index;
    GetResult<FollowJointTrajectory>::Request result;
    result.goal_id.uuid = id_of(index);
    call<GetResult<FollowJointTrajectory>>("get_result", result, [this, index](const auto& r) {
      answers[index].finished_at = time();
      answers[index].status = static_cast<GoalStatus>(r.status);
      answers[index].result = r.result;
    });
    return index;
  }
  std::size_t send(const JointTrajectory& message) {
    FollowJointTrajectory::Goal goal;
    goal.trajectory = message;
    return send(goal);
  }
  void cancel(std::size_t index) {
    action_msgs::srv::CancelGoal::Request request;
    request.goal_info.goal_id.uuid = id_of(index);
    call<action_msgs::srv::CancelGoal>("cancel_goal", request, [](const auto&) {});
  }
  static GoalId id_of(std::size_t index) {
    GoalId id{};
    id[0] = static_cast<std::uint8_t>(index + 1);
    return id;
  }
  template <class S>
  void call_service(const std::string& service, const typename S::Request& request,
                    std::function<void(const typename S::Response&)> reply) {
    edge_->call(service, to_cdr(request), [reply](const Status& status, const Bytes& bytes) {
      require(status);
      typename S::Response response;
      require(from_cdr(bytes, response));
      reply(response);
    });
    bus.set_now(now);
    bus.spin();
  }

  std::vector<Answer> answers;
  [[nodiscard]] double command(const std::string& full_name) const {
    return hardware->last_command(full_name);
  }
  Status set_parameter(const std::string& name, const ParameterValue& value) {
    Status outcome = Status::refused("no answer");
    edge_->set_parameter("/arm", name, value, [&](const Status& status) { outcome = status; });
    bus.spin();
    return outcome;
  }

  static void require(const Status& status) {
    if (!status) throw std::runtime_error(status.why());
  }

 private:
  static ControllerManagerOptions manager_options(const JtcOptions& options) {
    ControllerManagerOptions out;
    out.enforce_limits = options.enforce_limits;
    return out;
  }
  Status switch_to(const std::vector<std::string>& on, const std::vector<std::string>& off) {
    return manager->switch_controllers(on, off, Strictness::strict);
  }
  template <class S, class Reply>
  void call(const std::string& service, const typename S::Request& request, Reply reply) {
    call_service<S>("/arm/follow_joint_trajectory/_action/" + service, request, reply);
  }

  Node speaker_;
  Publisher<JointTrajectory> trajectories_;
  std::unique_ptr<Edge> edge_;
};

}  // namespace doppel
