// joint_trajectory_controller as an action server, over the bus.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/test/jtc_rig.h"

namespace doppel {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using Names = std::vector<std::string>;
using Result = FollowJointTrajectory::Result;
using Feedback = FeedbackMessage<FollowJointTrajectory>;
constexpr const char* kFeedback = "/arm/follow_joint_trajectory/_action/feedback";

JtcOptions options_with(std::string more, Names commands = {kPosition}) {
  JtcOptions options;
  options.commands = std::move(commands);
  options.more = std::move(more);
  return options;
}

FollowJointTrajectory::Goal goal_of(JointTrajectory message) {
  FollowJointTrajectory::Goal goal;
  goal.trajectory = std::move(message);
  return goal;
}

class JtcActionCombinations : public testing::TestWithParam<Names> {};

// jtc.md, B52, B54.
TEST_P(JtcActionCombinations, SuccessKeepsLastPoint) {
  JtcRig rig(
      options_with("gains: {a: {p: 5.0, ff_velocity_scale: 1.0}, b: {p: 5.0, ff_velocity_scale: 1.0}, "
                   "c: {p: 5.0, ff_velocity_scale: 1.0}}, "
                   "constraints: {a: {goal: 0.05}, b: {goal: 0.05}, c: {goal: 0.05}}",
                   GetParam()));
  const auto goal = rig.send(
      trajectory(kJoints, {point(0.5, {0.5, 0.2, 0}, {1, 0, 0}), point(1, {1, 0.5, -0.5}, {0, 0, 0})}));
  ASSERT_TRUE(rig.answers[goal].accepted.value_or(false)) << rig.said();
  rig.run_for(1.5);
  ASSERT_TRUE(rig.answers[goal].finished_at);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::succeeded) << rig.answers[goal].result.error_string;
  EXPECT_EQ(rig.answers[goal].result.error_code, Result::SUCCESSFUL);
  EXPECT_NEAR(rig.hardware->position("a"), 1, 0.02);
  EXPECT_NEAR(rig.hardware->position("c"), -0.5, 0.02);
}

INSTANTIATE_TEST_SUITE_P(All, JtcActionCombinations,
                         testing::Values(Names{kPosition}, Names{kPosition, kVelocity},
                                         Names{kPosition, kVelocity, kAcceleration}, Names{kVelocity},
                                         Names{kPosition, kEffort}));

// jtc.md, B52.
TEST(JtcAction, SucceedsAtLastPoint) {
  JtcRig rig;
  const double start = rig.time();
  const auto goal = rig.send(trajectory(kJoints, {point(1.0, {1, 0.5, -0.5})}));
  rig.run_for(0.99);
  EXPECT_FALSE(rig.answers[goal].finished_at);
  rig.run_for(0.2);
  ASSERT_TRUE(rig.answers[goal].finished_at);
  EXPECT_GE(*rig.answers[goal].finished_at, start + 1.0);
  EXPECT_EQ(rig.answers[goal].result.error_string, "Goal successfully reached!");
}

// jtc.md, B52.
TEST(JtcAction, JointOutsideGoalToleranceDelaysSuccess) {
  JtcRig rig(options_with("constraints: {c: {goal: 0.01}}"));
  rig.hardware->set_offset("c", 0.1);
  rig.run(1);
  const auto goal = rig.send(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  rig.run_for(3);
  EXPECT_FALSE(rig.answers[goal].finished_at);
  rig.hardware->set_offset("c", 0.005);
  rig.run_for(0.1);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::succeeded);
}

// jtc.md, B54.
TEST(JtcAction, NonzeroEndVelocityStaysCommanded) {
  JtcRig rig(options_with("allow_nonzero_velocity_at_trajectory_end: true", {kPosition, kVelocity}));
  const auto goal = rig.send(trajectory(kJoints, {point(0.5, {1, 1, 1}, {2, 2, 2})}));
  rig.hardware->set_offset("a", 0.2);
  rig.run_for(2);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::succeeded);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);  // commanded, not the measured 1.2
  EXPECT_DOUBLE_EQ(rig.command("a/velocity"), 2);
}

// jtc.md, B16, B17, B23.
TEST(JtcAction, BadGoalsAreRejected) {
  JtcRig rig;
  const std::vector<JointTrajectory> bad = {
      trajectory({"a", "b"}, {point(1, {1, 1})}), trajectory({"a", "b", "d"}, {point(1, {1, 1, 1})}),
      trajectory(kJoints, {point(1, {1, 1, 1}, {0, 1, 0})}), trajectory(kJoints, {}),
      trajectory(kJoints, {point(1, {1, std::nan(""), 1})})};
  for (const JointTrajectory& message : bad) {
    const auto goal = rig.send(message);
    EXPECT_EQ(rig.answers[goal].accepted, false);
  }
  EXPECT_EQ(rig.count(Severity::error, "; the goal is rejected"), bad.size());
  EXPECT_EQ(rig.count(Severity::error, "lists joint 'd', which this controller does not have"), 1u);
  // A rejected goal has no effect.
  const auto good = rig.send(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  rig.send(bad[0]);
  rig.run_for(1);
  EXPECT_EQ(rig.answers[good].status, GoalStatus::succeeded);
}

// jtc.md, B27.
TEST(JtcAction, InactiveControllerRejectsGoal) {
  JtcRig rig;
  ASSERT_TRUE(rig.deactivate().ok());
  const auto goal = rig.send(trajectory(kJoints, {point(1, {1, 1, 1})}));
  EXPECT_EQ(rig.answers[goal].accepted, false);
  EXPECT_EQ(rig.count(Severity::error, "'arm' is not active; activate it first"), 1u);
}

// jtc.md, B50.
TEST(JtcAction, PathViolationAbortsWithDetails) {
  JtcRig rig(options_with("constraints: {b: {trajectory: 0.1}, c: {trajectory: 0.1}}"));
  rig.hardware->block("b");
  const auto goal = rig.send(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(0.5);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::aborted);
  EXPECT_EQ(rig.answers[goal].result.error_code, Result::PATH_TOLERANCE_VIOLATED);
  EXPECT_EQ(rig.answers[goal].result.error_string,
            "Aborted due to path tolerance violation: joint 'b' has a position error of 0.11, the tolerance "
            "is 0.1, 0.110 s "
            "after the start");
  EXPECT_DOUBLE_EQ(rig.command("b/position"), 0);  // held at the measured position
  EXPECT_NEAR(rig.command("a/position"), 0.11, 0.011);
}

// jtc.md, B53.
TEST(JtcAction, GoalViolationAborts) {
  JtcRig rig(options_with("constraints: {goal_time: 0.3, a: {goal: 0.01}}"));
  rig.hardware->set_offset("a", -0.2);
  rig.run(1);
  const auto goal = rig.send(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  rig.run_for(0.75);
  EXPECT_FALSE(rig.answers[goal].finished_at);
  rig.run_for(0.2);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::aborted);
  EXPECT_EQ(rig.answers[goal].result.error_code, Result::GOAL_TOLERANCE_VIOLATED);
  EXPECT_THAT(rig.answers[goal].result.error_string,
              AllOf(HasSubstr("Aborted due to goal_time_tolerance exceeding by 0.01"), HasSubstr("joint 'a'"),
                    HasSubstr("error of 0.2, the tolerance is 0.01"), HasSubstr("0.810 s after the start")));
  EXPECT_NEAR(rig.command("a/position"), 0.8, 1e-9);
}

// jtc.md, B57.
TEST(JtcAction, GoalTolerancesApplyToOneGoal) {
  JtcRig rig(options_with("constraints: {a: {trajectory: 0.1}}"));
  rig.hardware->block("a");
  auto lenient = goal_of(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  lenient.path_tolerance = {{"c", 0.1, 0, 0}, {"a", -1, 0, 0}};
  const auto first = rig.send(lenient);
  rig.run_for(1);
  EXPECT_EQ(rig.answers[first].status, GoalStatus::succeeded);
  auto strict = goal_of(trajectory(kJoints, {point(0.5, {0.06, 0, 0})}));
  strict.path_tolerance = {{"a", 0.03, 0, 0}};
  const auto second = rig.send(strict);
  rig.run_for(1);
  EXPECT_EQ(rig.answers[second].result.error_code, Result::PATH_TOLERANCE_VIOLATED);
  const auto third = rig.send(trajectory(kJoints, {point(0.5, {0.06, 0, 0})}));
  rig.run_for(1);
  EXPECT_EQ(rig.answers[third].status, GoalStatus::succeeded);
  auto nonsense = goal_of(trajectory(kJoints, {point(0.5, {0.06, 0, 0})}));
  nonsense.path_tolerance = {{"a", 0.03, 0, 0}, {"d", 0.03, 0, 0}};
  const auto fourth = rig.send(nonsense);
  rig.run_for(1);
  EXPECT_EQ(rig.answers[fourth].status, GoalStatus::succeeded);
  EXPECT_EQ(rig.count(Severity::error, "uses the default tolerances"), 1u);
}

// jtc.md, B57.
TEST(JtcAction, GoalTimeOfGoalIsUsed) {
  JtcRig rig(options_with("constraints: {a: {goal: 0.01}}"));
  rig.hardware->set_offset("a", -0.2);
  rig.run(1);
  auto goal = goal_of(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  goal.goal_time_tolerance = to_duration_msg(from_seconds(0.1));
  const auto index = rig.send(goal);
  rig.run_for(1);
  EXPECT_EQ(rig.answers[index].result.error_code, Result::GOAL_TOLERANCE_VIOLATED);
}

// jtc.md, B58.
TEST(JtcAction, CommandTimeoutAbortsWaitingGoal) {
  JtcRig rig(options_with("cmd_timeout: 0.3, constraints: {a: {goal: 0.01}}"));
  rig.hardware->set_offset("a", -0.2);
  rig.run(1);
  const auto goal = rig.send(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  rig.run_for(1);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::aborted);
  EXPECT_THAT(rig.answers[goal].result.error_string,
              AllOf(HasSubstr("command timeout"), HasSubstr("joint 'a'")));
}

// jtc.md, B60.
TEST(JtcAction, FeedbackIsSentAtMonitorRate) {
  JtcRig rig(options_with("action_monitor_rate: 10.0"));
  Recorder<Feedback> feedback(rig.bus, kFeedback);
  const auto goal = rig.send(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(2);
  EXPECT_THAT(feedback.messages, SizeIs(testing::AllOf(testing::Ge(9u), testing::Le(11u))));
  const auto& middle = feedback.messages[5];
  EXPECT_EQ(middle.goal_id.uuid, JtcRig::id_of(goal));
  EXPECT_THAT(middle.feedback.joint_names, ElementsAre("a", "b", "c"));
  EXPECT_NEAR(middle.feedback.desired.positions[0],
              to_seconds(from_msg(middle.feedback.desired.time_from_start)), 1e-9);
  EXPECT_THAT(middle.feedback.actual.velocities, SizeIs(3));
  EXPECT_THAT(middle.feedback.error.positions, SizeIs(3));
}

// jtc.md, B60.
TEST(JtcAction, ResultIsSentAtMonitorRate) {
  JtcRig rig(options_with("action_monitor_rate: 2.0"));
  const auto goal = rig.send(trajectory(kJoints, {point(0.1, {1, 1, 1})}));
  rig.run_for(0.3);
  EXPECT_FALSE(rig.answers[goal].finished_at);
  rig.run_for(0.4);
  EXPECT_TRUE(rig.answers[goal].finished_at);
}

// jtc.md, B60.
TEST(JtcAction, AcceptedGoalIsExecuting) {
  JtcRig rig;
  Recorder<action_msgs::msg::GoalStatusArray> status(rig.bus, "/arm/follow_joint_trajectory/_action/status");
  rig.send(trajectory(kJoints, {point(1, {1, 1, 1})}));
  ASSERT_FALSE(status.messages.empty());
  ASSERT_THAT(status.messages.back().status_list, SizeIs(1));
  EXPECT_EQ(status.messages.back().status_list[0].status, action_msgs::msg::GoalStatus::STATUS_EXECUTING);
}

// jtc.md, B61.
TEST(JtcAction, NewGoalPreemptsOldGoal) {
  JtcRig rig;
  const auto first = rig.send(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(0.5);
  const auto second = rig.send(trajectory(kJoints, {point(0.5, {0, 0, 0})}));
  // At once, before the next update.
  EXPECT_EQ(rig.answers[first].status, GoalStatus::aborted);
  EXPECT_EQ(rig.answers[first].result.error_code, Result::INVALID_GOAL);
  EXPECT_EQ(rig.answers[first].result.error_string, "Current goal preempted by new incoming action.");
  rig.run_for(1);
  EXPECT_EQ(rig.answers[second].status, GoalStatus::succeeded);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0);
}

TEST(JtcAction, ResultSurvivesNextTrajectory) {
  JtcRig rig(options_with("action_monitor_rate: 1.0, constraints: {a: {trajectory: 0.05}}"));
  rig.hardware->block("a");
  const auto goal = rig.send(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run(12);  // violated, not yet reported
  rig.say(trajectory(kJoints, {point(0.1, {1, 1, 1})}));
  rig.run(12);  // violated again
  rig.run_for(2);
  EXPECT_EQ(rig.answers[goal].result.error_code, Result::PATH_TOLERANCE_VIOLATED);
  EXPECT_EQ(rig.count(Severity::error, "Holding position"), 1u);
}

// jtc.md, B62.
TEST(JtcAction, TopicTrajectoryReplacesGoalAndIsReported) {
  JtcRig rig;
  const auto goal = rig.send(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  rig.run_for(0.2);
  rig.say(trajectory(kJoints, {point(1, {-1, -1, -1})}));
  rig.run_for(0.5);
  EXPECT_FALSE(rig.answers[goal].finished_at);
  rig.run_for(0.7);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::succeeded);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), -1);
  EXPECT_EQ(rig.count(Severity::warning, "replaces the trajectory of the active goal for a, b, c"), 1u);
  EXPECT_EQ(rig.count(Severity::warning, "cancel the goal before sending to the topic"), 1u);
}

// jtc.md, B63.
TEST(JtcAction, CancelHoldsPosition) {
  JtcRig rig;
  rig.hardware->set_offset("b", 0.05);
  const auto goal = rig.send(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(0.5);
  rig.cancel(goal);
  rig.run(6);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::canceled);
  EXPECT_EQ(rig.answers[goal].result.error_code, Result::SUCCESSFUL);
  const double held = rig.command("b/position");
  EXPECT_NEAR(held, 0.55, 0.03);
  rig.run_for(1);
  EXPECT_DOUBLE_EQ(rig.command("b/position"), held);
}

// jtc.md, B63.
TEST(JtcAction, CancelBeforeStartIsAccepted) {
  JtcRig rig;
  const auto goal = rig.send(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.cancel(goal);
  rig.run_for(1.5);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::canceled);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0);
  const auto next = rig.send(trajectory(kJoints, {point(0.2, {1, 1, 1})}));
  rig.run_for(0.5);
  EXPECT_EQ(rig.answers[next].status, GoalStatus::succeeded);
}

// jtc.md, B64.
TEST(JtcAction, CancelDeceleratesWhereConfigured) {
  JtcOptions options = options_with(
      "constraints: {decelerate_on_cancel: true, a: {max_deceleration_on_cancel: 2.0}, b: "
      "{max_deceleration_on_cancel: 8.0}}");
  options.joints = {{.name = "a", .velocity = 5}, {.name = "b", .velocity = 5}};
  JtcRig rig(options);
  const auto goal = rig.send(trajectory({"a", "b"}, {point(1, {2, -2})}));
  rig.run_for(0.5);
  const double a = rig.hardware->position("a"), b = rig.hardware->position("b");
  rig.cancel(goal);
  rig.run_for(0.5);
  EXPECT_NEAR(rig.command("b/position"), b - 0.25, 0.03);  // v = 2: v^2 / 2d = 1/4 after v / d = 1/4 s
  EXPECT_GT(std::abs(rig.hardware->velocity("a")), 0.5);   // 1 s until standstill, half of it has passed
  rig.run_for(1);
  EXPECT_NEAR(rig.command("a/position"), a + 1.0, 0.03);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::canceled);
  rig.run_for(0.1);
  EXPECT_DOUBLE_EQ(rig.hardware->velocity("a"), 0);
}

class JtcScaling : public testing::TestWithParam<double> {};

// jtc.md, B71.
TEST_P(JtcScaling, ScalingStretchesDurationAndTolerances) {
  const double factor = GetParam();
  JtcRig rig(options_with("constraints: {goal_time: 0.01, a: {trajectory: 0.02, goal: 0.001}}"));
  rig.say("/arm/speed_scaling_input", control_msgs::msg::SpeedScalingFactor{factor});
  const double start = rig.time();
  const auto goal = rig.send(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(1 / factor + 0.2);
  ASSERT_EQ(rig.answers[goal].status, GoalStatus::succeeded) << rig.answers[goal].result.error_string;
  EXPECT_NEAR(*rig.answers[goal].finished_at - start, 1 / factor, 0.08);
}

INSTANTIATE_TEST_SUITE_P(Factors, JtcScaling, testing::Values(0.25, 0.5, 0.87, 1.0, 2.0));

}  // namespace
}  // namespace doppel
