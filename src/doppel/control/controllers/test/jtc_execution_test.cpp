// joint_trajectory_controller following trajectories from the topic.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/test/jtc_rig.h"

namespace doppel {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Names = std::vector<std::string>;
using State = control_msgs::msg::JointTrajectoryControllerState;
constexpr double kPeriod = 0.01;

// -- every combination of interfaces follows a trajectory

struct Combination {
  Names commands, states;
};

class JtcCombinations : public testing::TestWithParam<Combination> {};

// jtc.md, B2, B3, B43.
TEST_P(JtcCombinations, TrajectoryIsFollowedToEnd) {
  const Names& commands = GetParam().commands;
  JtcOptions options =
      options_of(commands, GetParam().states,
                 "gains: {a: {p: 5.0, ff_velocity_scale: 1.0}, b: {p: 5.0, ff_velocity_scale: 1.0}, "
                 "c: {p: 5.0, ff_velocity_scale: 1.0}}");
  JtcRig rig(options);
  rig.say(trajectory(kJoints, {point(1, {0.5, 1, -1}, {0.5, 1, -1}), point(2, {1, 2, -2}, {0, 0, 0})}));
  rig.run_for(3);
  if (commands == Names{kEffort}) {
    // Nothing moves under effort alone here; the loop commands p times the error towards the goal.
    EXPECT_NEAR(rig.command("b/effort"), 5 * 2, 1e-9);
    return;
  }
  EXPECT_NEAR(rig.hardware->position("a"), 1, 1e-3);
  EXPECT_NEAR(rig.hardware->position("b"), 2, 1e-3);
  EXPECT_NEAR(rig.hardware->position("c"), -2, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    All, JtcCombinations,
    testing::Values(Combination{{kPosition}, {kPosition}}, Combination{{kPosition}, {kPosition, kVelocity}},
                    Combination{{kPosition}, {kPosition, kVelocity, kAcceleration}},
                    Combination{{kPosition, kVelocity}, {kPosition}},
                    Combination{{kPosition, kVelocity}, {kPosition, kVelocity}},
                    Combination{{kPosition, kVelocity}, {kPosition, kVelocity, kAcceleration}},
                    Combination{{kPosition, kVelocity, kAcceleration}, {kPosition}},
                    Combination{{kPosition, kVelocity, kAcceleration}, {kPosition, kVelocity}},
                    Combination{{kPosition, kVelocity, kAcceleration}, {kPosition, kVelocity, kAcceleration}},
                    Combination{{kVelocity}, {kPosition, kVelocity}},
                    Combination{{kVelocity}, {kPosition, kVelocity, kAcceleration}},
                    Combination{{kEffort}, {kPosition, kVelocity}},
                    Combination{{kEffort}, {kPosition, kVelocity, kAcceleration}},
                    Combination{{kPosition, kEffort}, {kPosition, kVelocity}},
                    Combination{{kPosition, kEffort}, {kPosition, kVelocity, kAcceleration}}));

// -- which trajectories from the topic are accepted

TEST(JtcExecution, BadMessageIsDroppedAndLastCommandHolds) {
  JtcRig rig;
  rig.say(trajectory(kJoints, {point(0.1, {1, 1, 1})}));
  rig.run_for(0.2);
  rig.say(trajectory(kJoints, {point(0.1, {1, std::nan(""), 1})}));
  rig.say(trajectory({"a"}, {point(0.1, {5})}));
  rig.say(trajectory(kJoints, {}));
  rig.run_for(0.2);
  EXPECT_DOUBLE_EQ(rig.command("b/position"), 1);
  EXPECT_EQ(rig.count(Severity::error, "joint 'b' has nan among the positions of point 1 of 1"), 1u)
      << rig.said();
  EXPECT_EQ(rig.count(Severity::error, "allow_partial_joints_goal"), 1u);
}

// jtc.md, B18.
TEST(JtcExecution, EmptyTrajectoryIsIgnored) {
  JtcRig rig;
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(0.5);
  rig.say(trajectory(kJoints, {}));
  rig.run_for(0.6);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
  EXPECT_EQ(rig.count(Severity::error, "an empty one does not stop the robot; to stop it, cancel the goal"),
            1u);
}

// jtc.md, B24.
TEST(JtcExecution, PastTrajectoryIsIgnored) {
  JtcRig rig;
  rig.run_for(5);
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}, 2.0));
  rig.run_for(1.5);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0);
  EXPECT_EQ(rig.count(Severity::error, "ends in the past"), 1u);
}

// jtc.md, B25.
TEST(JtcExecution, LateTrajectoryStartsInMiddleAndIsReported) {
  JtcRig rig;
  rig.run_for(5);
  rig.say(trajectory(kJoints, {point(0.5, {0, 0, 0}), point(2.5, {1, 2, 1})}, rig.time() - 1.5));
  rig.run(1);
  EXPECT_NEAR(rig.command("b/position"), 1, 0.02);
  EXPECT_EQ(rig.count(Severity::warning, "starts in the middle, where joint 'b' jumps by 0.99"), 1u)
      << rig.said();
}

// jtc.md, B26.
TEST(JtcExecution, FutureTrajectoryReplacesCurrent) {
  JtcRig rig;
  rig.say(trajectory(kJoints, {point(2, {2, 2, 2})}));
  rig.run_for(1);
  EXPECT_NEAR(rig.command("a/position"), 1, 0.02);
  rig.say(trajectory(kJoints, {point(1, {0, 0, 0})}, rig.time() + 1));
  rig.run_for(1);
  EXPECT_NEAR(rig.command("a/position"), 0.5, 0.02);  // half of two seconds from 1 to 0
  EXPECT_EQ(rig.count(Severity::warning, "the running trajectory is replaced now and joint 'a' moves"), 1u)
      << rig.said();
  rig.run_for(1.1);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0);
}

TEST(JtcExecution, CurrentStampGivesNoWarning) {
  JtcRig rig;
  rig.run_for(1);
  rig.say(trajectory(kJoints, {point(0, {0, 0, 0}), point(1, {1, 1, 1})}, rig.time()));
  rig.run_for(1.1);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
  EXPECT_EQ(rig.count(Severity::warning, "stamp"), 0u) << rig.said();
}

// jtc.md, B27.
TEST(JtcExecution, InactiveControllerIgnoresTopic) {
  JtcRig rig;
  ASSERT_TRUE(rig.deactivate().ok());
  rig.say(trajectory(kJoints, {point(0.1, {1, 1, 1})}));
  ASSERT_TRUE(rig.activate().ok());
  rig.run_for(0.5);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0);
  EXPECT_EQ(rig.count(Severity::warning, "not active"), 1u);
}

// -- the start of a trajectory

// jtc.md, B29.
TEST(JtcExecution, StartsFromMeasuredState) {
  JtcRig rig;
  rig.hardware->set_offset("a", -0.3);  // a servo that sags
  rig.run(1);
  rig.say(trajectory(kJoints, {point(1, {1, 0, 0})}));
  rig.run(1);
  EXPECT_NEAR(rig.command("a/position"), -0.3 + 1.3 * kPeriod, 1e-9);
}

// jtc.md, B29.
TEST(JtcExecution, StartsFromLastCommandWithoutJump) {
  JtcRig rig(options_of({kPosition}, {kPosition}, "interpolate_from_desired_state: true"));
  rig.hardware->set_offset("a", -0.3);
  rig.run(1);
  rig.say(trajectory(kJoints, {point(1, {1, 0, 0})}));
  rig.run(1);
  EXPECT_NEAR(rig.command("a/position"), 0, 2.1 * kPeriod);
  double last = rig.command("a/position");
  for (int i = 0; i < 100; ++i) {
    rig.run(1);
    EXPECT_NEAR(rig.command("a/position"), last, 1.1 * kPeriod);
    last = rig.command("a/position");
  }
}

// jtc.md, B38.
TEST(JtcExecution, CommandIsOnePeriodAheadOfDesired) {
  JtcRig rig;
  Recorder<State> states(rig.bus, "/arm/controller_state");
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run(1);
  EXPECT_NEAR(states.messages.back().reference.positions[0], 0, 1e-12);
  EXPECT_NEAR(states.messages.back().output.positions[0], kPeriod, 1e-12);
  rig.run(1);
  EXPECT_NEAR(states.messages.back().reference.positions[0], kPeriod, 1e-12);
  EXPECT_NEAR(states.messages.back().error.positions[0], 0, 1e-12);  // so a perfect servo has no error
}

// jtc.md, B39.
TEST(JtcExecution, JointOrderIsReordered) {
  JtcRig rig;
  rig.say(trajectory({"c", "a", "b"}, {point(0.1, {3, 1, 2})}));
  rig.run_for(0.2);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
  EXPECT_DOUBLE_EQ(rig.command("b/position"), 2);
  EXPECT_DOUBLE_EQ(rig.command("c/position"), 3);
}

// jtc.md, B40.
TEST(JtcExecution, PartialGoalHoldsLastPositionCommand) {
  JtcRig rig(options_of({kPosition}, {kPosition, kVelocity}, "allow_partial_joints_goal: true"));
  rig.say(trajectory(kJoints, {point(0.1, {1, 1, 1})}));
  rig.run_for(0.2);
  rig.hardware->set_offset("b", -0.2);
  rig.run(1);
  rig.say(trajectory({"c"}, {point(0.1, {2})}));
  rig.run_for(0.2);
  EXPECT_DOUBLE_EQ(rig.command("b/position"), 1);
  EXPECT_DOUBLE_EQ(rig.command("c/position"), 2);
}

// jtc.md, B40.
TEST(JtcExecution, PartialGoalHoldsStateWithoutCommand) {
  JtcRig rig(options_of({kVelocity}, {kPosition, kVelocity},
                        "allow_partial_joints_goal: true, gains: {c: {p: 1.0}}"));
  rig.hardware->set_position("b", 0.4);
  rig.run(1);
  rig.say(trajectory({"c"}, {point(0.5, {2}, {0})}));
  Recorder<State> states(rig.bus, "/arm/controller_state");
  rig.run_for(0.2);
  EXPECT_NEAR(states.messages.back().reference.positions[1], 0.4, 1e-12);
  EXPECT_DOUBLE_EQ(states.messages.back().reference.velocities[1], 0);
}

// jtc.md, B42.
TEST(JtcExecution, NewTrajectoryReplacesOld) {
  JtcRig rig(options_of({kPosition}, {kPosition}, "allow_partial_joints_goal: true"));
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(0.5);
  rig.say(trajectory({"a"}, {point(0.5, {0})}));
  rig.run_for(1);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0);
  EXPECT_NEAR(rig.command("b/position"), 0.5, 0.02);  // no longer on its way to 1
}

// jtc.md, B42.
TEST(JtcExecution, LastMessageBetweenUpdatesWins) {
  JtcRig rig;
  for (const double to : {1.0, 2.0, 3.0}) rig.say(trajectory(kJoints, {point(0.1, {to, to, to})}));
  rig.run_for(0.2);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 3);
}

// jtc.md, B34.
TEST(JtcExecution, InterpolationNoneStepsToPoints) {
  JtcRig rig(options_of({kPosition}, {kPosition}, "interpolation_method: none"));
  rig.say(trajectory(kJoints, {point(0.5, {1, 1, 1}), point(1, {2, 2, 2})}));
  rig.run_for(0.4);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0);
  rig.run_for(0.3);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 2);
}

// jtc.md, B20, B32.
TEST(JtcExecution, VelocityTrajectoryIsIntegrated) {
  JtcRig rig(options_of({kPosition}, {kPosition}, "allow_integration_in_goal_trajectories: true"));
  rig.say(trajectory(kJoints, {point(1, {}, {1, 2, 0}), point(2, {}, {0, 0, 0})}));
  rig.run_for(2.1);
  EXPECT_NEAR(rig.command("a/position"), 1, 1e-9);
  EXPECT_NEAR(rig.command("b/position"), 2, 1e-9);
}

// -- what is commanded

// jtc.md, B43.
TEST(JtcExecution, VelocityAndAccelerationAreForwarded) {
  JtcRig rig(options_of({kPosition, kVelocity, kAcceleration}));
  rig.say(trajectory(kJoints,
                     {point(0, {0, 0, 0}, {0, 0, 0}, {1, 1, 1}), point(1, {1, 1, 1}, {0, 0, 0}, {0, 0, 0})}));
  rig.run(1);
  // The quintic 1/2 t^2 + 17/2 t^3 - 27/2 t^4 + 11/2 t^5 one period ahead.
  EXPECT_NEAR(rig.command("a/acceleration"), 1 + 0.51 - 0.0162 + 0.00011, 1e-9);
  rig.run_for(0.49);
  EXPECT_GT(rig.command("a/velocity"), 1);
}

// jtc.md, B44.
TEST(JtcExecution, VelocityIsFeedForwardPlusPid) {
  JtcRig rig(options_of({kVelocity}, {kPosition, kVelocity},
                        "gains: {a: {p: 3.0, d: 0.5, ff_velocity_scale: 0.8}}"));
  rig.hardware->block("a");
  Recorder<State> states(rig.bus, "/arm/controller_state");
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1}, {0, 0, 0})}));
  rig.run_for(0.3);
  rig.run(1);
  const State& now = states.messages.back();
  const double velocity_ahead = 6 * 0.31 * (1 - 0.31);  // of the cubic, one period ahead
  EXPECT_NEAR(now.output.velocities[0],
              0.8 * velocity_ahead + 3 * now.error.positions[0] + 0.5 * now.error.velocities[0], 1e-9);
  EXPECT_GT(now.error.positions[0], 0.1);
}

// jtc.md, B44.
TEST(JtcExecution, EffortAddsTrajectoryEffort) {
  JtcRig rig(options_of({kEffort}, {kPosition, kVelocity}, "gains: {a: {p: 3.0}}"));
  rig.say(
      trajectory(kJoints, {point(0, {1, 0, 0}, {}, {}, {2, 2, 2}), point(1, {1, 0, 0}, {}, {}, {2, 2, 2})}));
  rig.run(2);
  EXPECT_NEAR(rig.command("a/effort"), 2 + 3 * 1, 1e-9);
  EXPECT_NEAR(rig.command("b/effort"), 2, 1e-9);
}

// jtc.md, B45.
TEST(JtcExecution, PositionAndEffortForwardEffort) {
  JtcRig rig(options_of({kPosition, kEffort}, {kPosition, kVelocity}, "gains: {a: {p: 300.0}}"));
  rig.say(trajectory(kJoints,
                     {point(0.5, {1, 1, 1}, {}, {}, {4, 5, 6}), point(1, {1, 1, 1}, {}, {}, {4, 5, 6})}));
  rig.run_for(0.7);
  EXPECT_NEAR(rig.command("b/effort"), 5, 1e-9);
  EXPECT_DOUBLE_EQ(rig.command("b/position"), 1);
  rig.say(trajectory(kJoints, {point(0.1, {0, 0, 0})}));
  rig.run_for(0.3);
  EXPECT_DOUBLE_EQ(rig.command("b/effort"), 0);
}

// jtc.md, B46.
TEST(JtcExecution, GainsChangeWhileRunning) {
  JtcRig rig(options_of({kEffort}, {kPosition, kVelocity}, "gains: {a: {p: 1.0}}"));
  rig.hardware->set_position("a", -1);
  rig.run(2);
  EXPECT_DOUBLE_EQ(rig.command("a/effort"), 1);
  ASSERT_TRUE(rig.set_parameter("gains.a.p", 7.0).ok());
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.command("a/effort"), 7);
  ASSERT_TRUE(rig.set_parameter("gains.a.u_clamp_max", 2.0).ok());
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.command("a/effort"), 2);
  EXPECT_TRUE(rig.set_parameter("gains.a.u_clamp_min", 3.0).ok());  // above u_clamp_max: the old gains stay
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.command("a/effort"), 2);
  EXPECT_EQ(rig.count(Severity::error, "the previous values stay in effect"), 1u);
  EXPECT_FALSE(rig.set_parameter("joints", std::vector<std::string>{"a"}).ok());
}

// jtc.md, B46.
TEST(JtcExecution, ToleranceChangeAppliesToNextGoalAndIsReported) {
  JtcRig rig;
  ASSERT_TRUE(rig.set_parameter("constraints.a.trajectory", 0.01).ok());
  EXPECT_EQ(rig.count(Severity::warning, "'constraints.a.trajectory' applies from the next action goal on"),
            1u);
  rig.hardware->block("a");
  rig.say(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  rig.run_for(0.6);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);  // the trajectory of the topic still uses the old ones
  rig.hardware->block("a", false);
  rig.run_for(0.5);
  rig.hardware->block("a");
  const auto goal = rig.send(trajectory(kJoints, {point(0.5, {0, 0, 0})}));
  rig.run_for(0.5);
  EXPECT_EQ(rig.answers[goal].result.error_code, FollowJointTrajectory::Result::PATH_TOLERANCE_VIOLATED);
}

// jtc.md, B46.
TEST(JtcExecution, PartialGoalsAndEndVelocityCanBeAllowedWhileRunning) {
  JtcRig rig;
  ASSERT_TRUE(rig.set_parameter("allow_partial_joints_goal", true).ok());
  ASSERT_TRUE(rig.set_parameter("allow_nonzero_velocity_at_trajectory_end", true).ok());
  rig.say(trajectory({"a"}, {point(0.2, {1}, {2})}));
  rig.run_for(0.3);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
}

// -- tolerances and the end of a trajectory

// jtc.md, B48, B51.
TEST(JtcExecution, PathViolationHoldsPosition) {
  JtcRig rig(options_of({kPosition}, {kPosition, kVelocity}, "constraints: {b: {trajectory: 0.1}}"));
  rig.hardware->block("b");
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  double before = 0;
  int ticks = 0;
  // Until the cycle of the violation: nothing is written in it, and the hold starts in the next one.
  for (; ticks < 50; ++ticks) {
    rig.run(1);
    const double command = rig.command("b/position");
    if (command == before) break;
    before = command;
  }
  EXPECT_NEAR(before, 0.11, 1e-9);
  EXPECT_EQ(ticks, 11);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.command("b/position"), 0);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), rig.hardware->position("a"));
  rig.run_for(1);
  EXPECT_DOUBLE_EQ(rig.command("b/position"), 0);
  EXPECT_EQ(rig.count(Severity::error,
                      "Holding position due to path tolerance violation: joint 'b' has a position error"),
            1u)
      << rig.said();
}

// jtc.md, B50.
TEST(JtcExecution, FirstSampleIsCheckedEvenAtLastPoint) {
  JtcRig rig(options_of({kPosition}, {kPosition, kVelocity}, "constraints: {a: {trajectory: 0.1}}"));
  rig.say(trajectory(kJoints, {point(0, {1, 0, 0})}));
  rig.run_for(0.2);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0);
  EXPECT_EQ(rig.count(Severity::error, "joint 'a' has a position error of 1, the tolerance is 0.1"), 1u)
      << rig.said();
}

// jtc.md, B53.
TEST(JtcExecution, MissedGoalHoldsPosition) {
  JtcRig rig(
      options_of({kPosition}, {kPosition, kVelocity}, "constraints: {goal_time: 0.5, a: {goal: 0.01}}"));
  rig.hardware->set_offset("a", -0.2);
  rig.run(1);
  rig.say(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  rig.run_for(0.9);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
  rig.run_for(0.2);
  EXPECT_NEAR(rig.command("a/position"), 0.8, 1e-9);
  EXPECT_EQ(rig.count(Severity::error, "goal_time_tolerance exceeding by"), 1u);
}

// jtc.md, B49.
TEST(JtcExecution, GoalTimeZeroWaitsForever) {
  JtcRig rig(options_of({kPosition}, {kPosition, kVelocity}, "constraints: {a: {goal: 0.01}}"));
  rig.hardware->set_offset("a", -0.2);
  rig.run(1);
  rig.say(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  rig.run_for(20);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
}

// jtc.md, B55.
TEST(JtcExecution, HoldIsNotChecked) {
  JtcRig rig(options_of({kPosition}, {kPosition, kVelocity},
                        "constraints: {a: {trajectory: 0.1, goal: 0.1}, goal_time: 0.1}"));
  rig.hardware->block("a");
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(1);
  ASSERT_EQ(rig.count(Severity::error, "Holding position"), 1u);
  rig.hardware->set_position("a", 2);
  rig.run_for(1);
  EXPECT_EQ(rig.count(Severity::error, "Holding position"), 1u);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0);
}

// jtc.md, B58.
TEST(JtcExecution, CommandTimeoutHoldsPosition) {
  JtcRig rig(options_of({kPosition, kVelocity}, {kPosition, kVelocity},
                        "cmd_timeout: 0.5, allow_nonzero_velocity_at_trajectory_end: true, "
                        "constraints: {stopped_velocity_tolerance: 0.0}"));
  rig.say(trajectory(kJoints, {point(0.5, {1, 1, 1}, {2, 2, 2})}));
  rig.run_for(0.9);
  EXPECT_DOUBLE_EQ(rig.command("a/velocity"), 2);
  rig.run_for(0.3);
  EXPECT_DOUBLE_EQ(rig.command("a/velocity"), 0);
  EXPECT_EQ(rig.count(Severity::error, "command timeout"), 1u) << rig.said();
}

// jtc.md, B58.
TEST(JtcExecution, TimeoutBelowGoalTimeIsIgnoredWithWarning) {
  JtcRig rig(options_of({kPosition}, {kPosition}, "cmd_timeout: 0.5, constraints: {goal_time: 0.5}"));
  EXPECT_EQ(rig.count(Severity::warning, "cmd_timeout of 0.5 s has no effect"), 1u);
  rig.say(trajectory(kJoints, {point(0.5, {1, 1, 1})}));
  rig.run_for(3);
  EXPECT_EQ(rig.count(Severity::error, "timeout"), 0u);
}

// jtc.md, B59.
TEST(JtcExecution, ErrorsIncludeUncommandedJoints) {
  JtcRig rig(options_of({kPosition}, {kPosition, kVelocity}, "command_joints: [c, a]"));
  Recorder<State> states(rig.bus, "/arm/controller_state");
  rig.say(trajectory({"b", "c", "a"}, {point(0.5, {2, 3, 1})}));
  rig.run_for(1);
  const State& now = states.messages.back();
  EXPECT_THAT(now.error.positions, testing::ElementsAre(0, 2, 0));
  EXPECT_THAT(now.reference.positions, testing::ElementsAre(1, 2, 3));
}

// -- braking

std::string braking(const std::string& more = "") {
  return "constraints: {decelerate_on_cancel: true, a: {max_deceleration_on_cancel: 2.0, trajectory: 0.05}, "
         "b: {max_deceleration_on_cancel: 4.0}}" +
         more;
}
JtcOptions braking_options(Names commands = {kPosition}) {
  JtcOptions options = options_of(std::move(commands), {kPosition, kVelocity}, braking());
  options.joints = {{.name = "a", .velocity = 5}, {.name = "b", .velocity = 5}};
  return options;
}

// jtc.md, B64.
TEST(JtcExecution, AbortDeceleratesEachJoint) {
  for (const double direction : {1.0, -1.0}) {
    JtcRig rig(braking_options());
    Recorder<State> states(rig.bus, "/arm/controller_state");
    rig.say(trajectory({"a", "b"}, {point(1, {1 * direction, 2 * direction})}));
    rig.run_for(0.5);
    const double a = rig.hardware->position("a"), b = rig.hardware->position("b");
    rig.hardware->set_offset("a", 0.2);  // a push: the robot leaves the path
    rig.run(1);
    rig.hardware->set_offset("a", 0);
    // Velocities are 1 and 2: after 1/2 s and 1/4 m, 1/2 s and 1/2 m.
    rig.run_for(1.5);
    EXPECT_NEAR(rig.command("b/position") - b, direction * 0.5, 0.03);
    EXPECT_NEAR(rig.command("a/position") - a, direction * 0.25 + 0.2, 0.03);
    double peak = 0;
    for (const State& state : states.messages)
      peak = std::max(peak, std::abs(state.reference.accelerations[1]));
    EXPECT_NEAR(peak, 4, 1e-6);
    EXPECT_EQ(rig.count(Severity::error, "path tolerance violation"), 1u);
  }
}

// jtc.md, B64.
TEST(JtcExecution, DecelerationRampsCommandToZero) {
  JtcOptions options = braking_options({kPosition, kVelocity});
  JtcRig rig(options);
  rig.say(trajectory({"a", "b"}, {point(1, {1, 2}, {1, 2}), point(2, {2, 4}, {0, 0})}));
  const auto goal = rig.send(trajectory({"a", "b"}, {point(1, {1, 2}, {0, 0})}));
  rig.run_for(0.5);
  rig.cancel(goal);
  double last = rig.command("b/velocity");
  EXPECT_GT(last, 1);
  for (int i = 0; i < 100; ++i) {
    rig.run(1);
    const double now = rig.command("b/velocity");
    EXPECT_LE(now, last + 0.08);
    EXPECT_GE(now, last - 0.12);
    last = now;
  }
  EXPECT_DOUBLE_EQ(last, 0);
}

// jtc.md, B64.
TEST(JtcExecution, TimeoutDecelerates) {
  JtcOptions options = braking_options({kVelocity});
  options.more = braking(
      ", cmd_timeout: 0.05, allow_nonzero_velocity_at_trajectory_end: true, "
      "gains: {a: {ff_velocity_scale: 1.0}, b: {ff_velocity_scale: 1.0}}");
  JtcRig rig(options);
  rig.say(trajectory({"a", "b"}, {point(1, {1, 1}, {2, 2})}));
  rig.run_for(1.03);
  EXPECT_DOUBLE_EQ(rig.command("b/velocity"), 2);
  rig.run_for(0.25);  // the timeout at 1.06 s, then 4 rad/s^2
  EXPECT_NEAR(rig.command("b/velocity"), 2 - 4 * 0.22, 0.1);
  rig.run_for(1.5);
  EXPECT_DOUBLE_EQ(rig.command("b/velocity"), 0);
  EXPECT_EQ(rig.count(Severity::error, "command timeout"), 1u);
}

// jtc.md, B65.
TEST(JtcExecution, ImpossibleDecelerationFallsBackToHold) {
  JtcOptions no_velocity = braking_options();
  no_velocity.states = {kPosition};
  EXPECT_EQ(JtcRig(no_velocity).count(Severity::warning, "there is no measured velocity"), 1u);
  JtcOptions no_deceleration = braking_options();
  no_deceleration.more = "constraints: {decelerate_on_cancel: true, a: {max_deceleration_on_cancel: 2.0}}";
  EXPECT_EQ(JtcRig(no_deceleration).count(Severity::warning, "joint 'b' has no deceleration"), 1u);
  JtcOptions no_limit = braking_options();
  no_limit.joints[1].velocity = kInfinity;
  JtcRig rig(no_limit);
  EXPECT_EQ(rig.count(Severity::warning, "joint 'b' has no velocity limit"), 1u);
  const auto goal = rig.send(trajectory({"a", "b"}, {point(1, {1, 2})}));
  rig.run_for(0.5);
  rig.cancel(goal);
  rig.run(1);
  const double held = rig.command("b/position");
  rig.run_for(0.5);
  EXPECT_DOUBLE_EQ(rig.command("b/position"), held);
  EXPECT_NEAR(held, 1, 0.02);
}

}  // namespace
}  // namespace doppel
