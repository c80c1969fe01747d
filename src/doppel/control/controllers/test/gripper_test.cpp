// Grippers through their action: success, stalling, preemption and cancelling, with a joint that follows its
// command with a first-order lag, p(t) = goal (1 - exp(-t / T)).

#include <gmock/gmock.h>

#include <cmath>

#include "doppel/control/controllers/builtin.h"
#include "doppel/control/controllers/test/action_rig.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {
namespace {

using control_msgs::action::GripperCommand;
using control_msgs::action::ParallelGripperCommand;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kLag = 0.1;  // T, s

FakeHardwareOptions lagging(std::vector<std::string> commands) {
  FakeHardwareOptions options;
  options.joints = {"a"};
  options.commands = std::move(commands);
  options.time_constant = kLag;
  options.more_commands = {{"hand", "max_effort", 0}, {"hand", "max_velocity", 0}};
  return options;
}

template <Action A>
struct Rig : ActionRig<A> {
  explicit Rig(const std::string& package, const std::string& more = "",
               std::vector<std::string> commands = {kPosition})
      : ActionRig<A>(controller_yaml("grip", package + "/GripperActionController",
                                     "joint: a" + (more.empty() ? "" : ", " + more)),
                     "/grip/gripper_cmd", {{"a"}}, lagging(std::move(commands))),
        feedbacks(this->bus, "/grip/gripper_cmd/_action/feedback") {
    this->start({"grip"});
  }
  Recorder<FeedbackMessage<A>> feedbacks;
};

TEST(GripperController, GoalWithinToleranceSucceeds) {
  Rig<GripperCommand> rig("position_controllers", "goal_tolerance: 0.01");
  rig.run(1);
  const double begin = to_seconds(rig.now);
  const auto goal = rig.send({{1.0, 7.5}});
  rig.run_for(1);
  const auto& answer = rig.answers[goal];
  EXPECT_EQ(answer.accepted, true);
  EXPECT_EQ(answer.status, GoalStatus::succeeded);
  // |1 - p| < 0.01 from t = T ln 100 = 0.4605 s on, reported within a period of 50 ms.
  EXPECT_GE(answer.finished_at.value() - begin, kLag * std::log(100.0));
  EXPECT_LE(answer.finished_at.value() - begin, kLag * std::log(100.0) + 0.08);
  EXPECT_NEAR(answer.result.position, 1.0, 0.01);
  EXPECT_TRUE(answer.result.reached_goal);
  EXPECT_FALSE(answer.result.stalled);
  EXPECT_EQ(answer.result.effort, 7.5) << "expected the allowed effort, as ros2_controllers reports it";
  EXPECT_GE(rig.feedbacks.messages.size(), 7U);
  EXPECT_EQ(rig.hardware->last_command("a/position"), 1.0) << "expected the joint to be held after success";
}

TEST(GripperController, StallFailsOrHolds) {
  for (const bool allowed : {false, true}) {
    Rig<GripperCommand> rig("position_controllers", std::string("stall_timeout: 0.3, allow_stalling: ") +
                                                        (allowed ? "true" : "false"));
    rig.run(1);
    rig.send({{1.0, 1.0}});
    rig.run_for(0.1);
    rig.hardware->block("a");
    rig.hardware->set_velocity("a", 0);
    const double stood = to_seconds(rig.now), where = rig.hardware->position("a");
    rig.run_for(1);
    EXPECT_EQ(rig.answers[0].status, allowed ? GoalStatus::succeeded : GoalStatus::aborted);
    EXPECT_NEAR(rig.answers[0].finished_at.value() - stood, 0.35, 0.06);
    EXPECT_TRUE(rig.answers[0].result.stalled);
    EXPECT_FALSE(rig.answers[0].result.reached_goal);
    EXPECT_EQ(rig.answers[0].result.position, where);
  }
}

TEST(GripperController, NewGoalPreemptsAndCancelHolds) {
  Rig<GripperCommand> rig("position_controllers");
  rig.run(1);
  rig.send({{1.0, 1.0}});
  rig.run_for(0.05);
  rig.send({{-1.0, 1.0}});
  EXPECT_EQ(rig.answers[0].status, GoalStatus::canceled)
      << "expected the status of preempted goals in ros2_controllers";
  EXPECT_EQ(rig.answers[1].accepted, true);
  rig.run_for(0.05);
  const double where = rig.hardware->position("a");
  rig.cancel(1);
  EXPECT_EQ(rig.answers[1].status, GoalStatus::canceled);
  rig.run_for(0.5);
  EXPECT_NEAR(rig.hardware->position("a"), where, 0.2);
  EXPECT_NE(rig.hardware->last_command("a/position"), -1.0);
}

TEST(GripperController, InvalidGoalIsRejected) {
  Rig<GripperCommand> rig("position_controllers");
  rig.run(1);
  rig.send({{std::nan(""), 1.0}});
  EXPECT_EQ(rig.answers[0].accepted, false);
  rig.send({{1.0, std::nan("")}});
  EXPECT_EQ(rig.answers[1].accepted, false) << "expected a rejection: the goal has no limit at all";
  const auto open = rig.send({{1.0, 1.0}});
  ASSERT_TRUE(rig.switch_to({}, {"grip"}));
  EXPECT_EQ(rig.answers[open].status, GoalStatus::aborted);
  rig.send({{1.0, 1.0}});
  EXPECT_EQ(rig.answers.back().accepted, false) << "expected a rejection: the controller is not active";
  ManagerRig nothing("");
  EXPECT_THAT(
      input_error_of([&] { nothing.manager->load("g", "position_controllers/GripperActionController"); }),
      HasSubstr("joint: NAME"));
}

TEST(GripperController, EffortIsLimitedToMaxEffort) {
  Rig<GripperCommand> rig("effort_controllers", "gains: {a: {p: 4.0, d: 0.5}}", {kEffort});
  rig.run(1);
  rig.send({{0.25, 1.5}});
  rig.run(2);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 1.0) << "expected 4 x 0.25";
  rig.hardware->set_velocity("a", 1.0);
  rig.run(2);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 0.5) << "expected 4 x 0.25 - 0.5 x 1";
  rig.hardware->set_velocity("a", 0.0);
  rig.send({{2.0, 1.5}});
  rig.run(2);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 1.5) << "expected the limit: 4 x 2 exceeds it";
  ASSERT_TRUE(rig.switch_to({}, {"grip"}));
  rig.run(1);
  EXPECT_FALSE(std::abs(rig.hardware->last_command("a/effort")) > 0) << "expected no remaining force";
}

TEST(GripperController, CommandOfTopicHoldsAndCancelsGoal) {
  Rig<GripperCommand> rig("effort_controllers", "gains: {a: {p: 4.0}}, max_effort: 3.0", {kEffort});
  const auto command = [&rig](double position, double max_effort) {
    rig.say<control_msgs::msg::GripperCommand>("/grip/command", {position, max_effort});
  };
  rig.run(1);
  rig.send({{2.0, 1.5}});
  command(0.25, 1.5);
  rig.run(2);
  EXPECT_EQ(rig.answers[0].status, GoalStatus::canceled);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 1.0) << "expected 4 x 0.25";
  command(2.0, 1.5);
  rig.run(2);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 1.5);
  command(std::nan(""), 1.5);
  rig.run(2);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 1.5) << "expected the last valid command";
  command(2.0, -1);
  rig.run(2);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 3.0) << "expected the controller's own limit";
}

TEST(ParallelGripperController, CommandSetsPositionEffortAndVelocity) {
  Rig<ParallelGripperCommand> rig(
      "parallel_gripper_action_controller",
      "max_effort_interface: hand/max_effort, max_velocity_interface: hand/max_velocity, max_effort: 3.0");
  rig.run(1);
  ParallelGripperCommand::Goal goal;
  rig.send(goal);
  EXPECT_EQ(rig.answers[0].accepted, false) << "expected a rejection: the goal has no position";
  goal.command.position = {0.5};
  goal.command.velocity = {0.25};
  rig.send(goal);
  EXPECT_EQ(rig.answers[1].accepted, true);
  rig.run_for(1);
  EXPECT_EQ(rig.answers[1].status, GoalStatus::succeeded);
  EXPECT_THAT(rig.answers[1].result.state.name, ElementsAre("a"));
  EXPECT_NEAR(rig.answers[1].result.state.position.at(0), 0.5, 0.01);
  EXPECT_EQ(rig.hardware->last_command("hand/max_effort"), 3.0)
      << "expected the parameter's value if the goal has none";
  EXPECT_EQ(rig.hardware->last_command("hand/max_velocity"), 0.25);
}

TEST(ParallelGripperController, PreemptedGoalHasNoPosition) {
  Rig<ParallelGripperCommand> rig("parallel_gripper_action_controller");
  rig.run(1);
  ParallelGripperCommand::Goal goal;
  goal.command.position = {0.5};
  rig.send(goal);
  rig.run_for(0.05);
  rig.send(goal);
  EXPECT_EQ(rig.answers[0].status, GoalStatus::canceled);
  EXPECT_TRUE(rig.answers[0].result.state.name.empty());
  EXPECT_TRUE(rig.answers[0].result.state.position.empty());
}

TEST(GripperController, BothTypesAreRegistered) {
  const auto names = builtin_controllers().names();
  for (const char* type :
       {"position_controllers/GripperActionController", "effort_controllers/GripperActionController",
        "parallel_gripper_action_controller/GripperActionController"}) {
    EXPECT_THAT(names, Contains(type));
  }
}

}  // namespace
}  // namespace doppel
