// Sends a trajectory of one point to a joint_trajectory_controller, as rclcpp_action's client does, and
// prints the feedback and the result:
//
//   ./doppel up omarm_one                                       # one shell
//   build/examples/trajectory_goal                              # another
//   build/examples/trajectory_goal --ros-args -p action:=/my_arm_controller/follow_joint_trajectory
//     -p joints:='[shoulder, elbow]' -p positions:='[0.5, -0.3]' -p seconds:=2.0
#include <fmt/format.h>

#include "doppel/base/core/time.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/network/action_client.h"

using doppel::control_msgs::action::FollowJointTrajectory;
using namespace std::chrono_literals;

namespace {

FollowJointTrajectory::Goal goal_of(doppel::ros2::Node& node) {
  FollowJointTrajectory::Goal goal;
  goal.trajectory.joint_names =
      node.declare_parameter("joints",
                             std::vector<std::string>{"Revolute 1", "Revolute 2", "Revolute 3", "Revolute 4",
                                                      "Revolute 5", "Revolute 6"},
                             "those of the controller");
  auto& point = goal.trajectory.points.emplace_back();
  point.positions = node.declare_parameter("positions", std::vector{0.5, -0.3, 0.0, 0.0, 0.0, 0.0},
                                           "one for each joint, rad or m");
  const double seconds = node.declare_parameter("seconds", 2.0, "duration of the motion, s");
  point.time_from_start = doppel::to_duration_msg(doppel::from_seconds(seconds));
  return goal;
}

void print_errors(const FollowJointTrajectory::Feedback& feedback) {
  std::string line = "position errors:";
  for (std::size_t i = 0; i < feedback.joint_names.size() && i < feedback.error.positions.size(); ++i)
    line += fmt::format("  {} {:+.4f}", feedback.joint_names[i], feedback.error.positions[i]);
  fmt::print("{}\n", line);
}

int run(int argc, char** argv) {
  doppel::ros2::Context context(argc, argv);
  doppel::ros2::Node node(context, "trajectory_goal");
  const auto action =
      node.declare_parameter<std::string>("action", "/omarm_arm_controller/follow_joint_trajectory");
  doppel::ros2::ActionClient<FollowJointTrajectory> client(node, action);
  if (!client.wait_for_action_server(10s)) {
    fmt::print(
        stderr,
        "error: no server offers the action {}\n"
        "  fix: start the twin, or pass -p action:=NAME; doppel --remote action list lists the names\n",
        action);
    return 1;
  }
  const auto goal = client.send_goal(goal_of(node), {.on_feedback = print_errors});
  if (!client.wait_for_result(*goal, 60s)) {
    fmt::print(stderr, "error: no result within 60 s\n");
    return 1;
  }
  if (goal->is_rejected()) {
    fmt::print(stderr, "error: the controller rejects the goal; its log says why\n");
    return 1;
  }
  const auto& result = goal->result();
  fmt::print("result: error_code {} {}\n", result.error_code, result.error_string);
  return result.error_code == FollowJointTrajectory::Result::SUCCESSFUL ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const doppel::InputError& wrong_use) {
    fmt::print(stderr, "{}\n", wrong_use.what());
    return 2;
  }
}
