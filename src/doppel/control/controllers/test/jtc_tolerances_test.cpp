// Tolerances: what violates them, and how those of a goal override the defaults.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/detail/tolerances.h"

namespace doppel::jtc {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using Goal = control_msgs::action::FollowJointTrajectory::Goal;

const std::vector<std::string> kTwoJoints = {"a", "b"};

Tolerances defaults() {
  Tolerances out;
  out.path = {{0.1, 0, 0}, {0.2, 0, 0}};
  out.goal = {{0.01, 0.01, 0}, {0.02, 0.01, 0}};
  out.goal_time = 0.5;
  return out;
}

struct Outcome {
  Tolerances tolerances;
  std::string problem;
};
Outcome with(const Goal& goal) {
  Outcome out;
  out.tolerances = tolerances_of(goal, defaults(), kTwoJoints, {"finger"}, out.problem);
  return out;
}

bool is_default(const Tolerances& t) {
  const Tolerances d = defaults();
  bool same = t.goal_time == d.goal_time;
  for (std::size_t j = 0; j < 2; ++j) {
    same &= t.path[j].position == d.path[j].position && t.path[j].velocity == d.path[j].velocity;
    same &= t.goal[j].position == d.goal[j].position && t.goal[j].velocity == d.goal[j].velocity;
  }
  return same;
}

// jtc.md, B49.
TEST(JtcTolerances, ZeroToleranceIsNotChecked) {
  Violation worst;
  check({0, 0, 0}, 0, 1e9, 1e9, 1e9, worst);
  EXPECT_FALSE(worst.any());
  check({0.1, 0.1, 0.1}, 0, 0.1, -0.1, 0.1, worst);
  EXPECT_FALSE(worst.any());
  check({0.1, 0, 0}, 0, std::nan(""), 0, 0, worst);
  EXPECT_FALSE(worst.any());
}

TEST(JtcTolerances, WorstViolationIsLargestMultiple) {
  Violation worst;
  check({0.1, 0, 0}, 0, -0.2, 0, 0, worst);
  check({1, 0.01, 0}, 1, 1.5, 0.05, 0, worst);
  check({0.1, 0, 0}, 2, 0.3, 0, 0, worst);
  EXPECT_EQ(worst.joint, 1u);
  EXPECT_EQ(worst.quantity, Violation::Quantity::velocity);
  EXPECT_DOUBLE_EQ(worst.error, 0.05);
  EXPECT_DOUBLE_EQ(worst.tolerance, 0.01);
}

// jtc.md, B57.
TEST(JtcTolerances, PositiveReplacesZeroKeepsAndMinusOneErases) {
  Goal goal;
  goal.path_tolerance = {{"b", 0.7, 0.8, 0.9}, {"a", 0, 0, 0}};
  goal.goal_tolerance = {{"a", -1, -1, 0}};
  goal.goal_time_tolerance = to_duration_msg(from_seconds(2));
  const Outcome out = with(goal);
  EXPECT_THAT(out.problem, IsEmpty());
  EXPECT_DOUBLE_EQ(out.tolerances.path[0].position, 0.1);
  EXPECT_DOUBLE_EQ(out.tolerances.path[1].position, 0.7);
  EXPECT_DOUBLE_EQ(out.tolerances.path[1].velocity, 0.8);
  EXPECT_DOUBLE_EQ(out.tolerances.path[1].acceleration, 0.9);
  EXPECT_DOUBLE_EQ(out.tolerances.goal[0].position, 0);
  EXPECT_DOUBLE_EQ(out.tolerances.goal[0].velocity, 0);
  EXPECT_DOUBLE_EQ(out.tolerances.goal[1].position, 0.02);
  EXPECT_DOUBLE_EQ(out.tolerances.goal_time, 2);
}

// jtc.md, B57.
TEST(JtcTolerances, GoalTimeMinusOneIsUnlimited) {
  Goal goal;
  goal.goal_time_tolerance = to_duration_msg(from_seconds(-1));
  EXPECT_DOUBLE_EQ(with(goal).tolerances.goal_time, 0);
}

// jtc.md, B57.
TEST(JtcTolerances, EmptyGoalUsesDefault) {
  EXPECT_TRUE(is_default(with({}).tolerances));
}

// jtc.md, B57.
TEST(JtcTolerances, InvalidValueVoidsAllTolerances) {
  for (const double bad : {-0.5, std::nan("")}) {
    Goal goal;
    goal.path_tolerance = {{"a", 0.9, 0, 0}, {"b", 0, bad, 0}};
    const Outcome out = with(goal);
    EXPECT_TRUE(is_default(out.tolerances));
    EXPECT_THAT(out.problem, AllOf(HasSubstr("velocity of joint 'b'"), HasSubstr("path_tolerance")));
  }
  Goal goal;
  goal.path_tolerance = {{"a", 0.9, 0, 0}};
  goal.goal_time_tolerance = to_duration_msg(from_seconds(-3));
  EXPECT_TRUE(is_default(with(goal).tolerances));
  EXPECT_THAT(with(goal).problem, HasSubstr("goal_time_tolerance is -3"));
}

// jtc.md, B57.
TEST(JtcTolerances, UnknownJointVoidsAllTolerances) {
  Goal goal;
  goal.path_tolerance = {{"a", 0.9, 0, 0}};
  goal.goal_tolerance = {{"bb", 0.9, 0, 0}};
  const Outcome out = with(goal);
  EXPECT_TRUE(is_default(out.tolerances));
  EXPECT_THAT(out.problem, AllOf(HasSubstr("goal_tolerance"), HasSubstr("'bb'")));
}

TEST(JtcTolerances, MimicJointsAreSkipped) {
  Goal goal;
  goal.path_tolerance = {{"finger", 0.9, 0, 0}, {"a", 0.4, 0, 0}};
  const Outcome out = with(goal);
  EXPECT_THAT(out.problem, IsEmpty());
  EXPECT_DOUBLE_EQ(out.tolerances.path[0].position, 0.4);
}

}  // namespace
}  // namespace doppel::jtc
