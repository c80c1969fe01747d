#include "doppel/review/identification/motion_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

// A pendulum of 1 kg at 0.5 m about a horizontal axis, with a ball at its end.
RobotDescription pendulum(double effort = 20) {
  RobotDescription out = test::make_pendulum(1.0, 0.5);
  out.joints[0].type = JointType::revolute;
  test::limit(out.joints[0], -1, 1.2, effort, 4);
  Collision ball;
  ball.geometry = Sphere{0.05};
  ball.origin.xyz = out.links[1].inertial->origin.xyz;
  out.links[1].collisions.push_back(ball);
  return out;
}

Model model_of(const RobotDescription& robot) {
  Diagnostics diagnostics;
  return compile_model(robot, BaseKind::fixed, diagnostics);
}

MotionPlan plan_of(const RobotDescription& robot) {
  const Model model = model_of(robot);
  PlanOptions options;
  options.seconds = 30;
  options.q = model.neutral();
  return plan_motion(robot, model, options);
}

std::pair<double, double> range_of(const MotionPlan& plan) {
  const auto [least, most] = std::ranges::minmax(plan.joints.at(0).path, {}, &Waypoint::position);
  return {least.position, most.position};
}

std::string rule_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const InputError& problem) {
    return problem.diagnostics().front().rule;
  }
  return "accepted";
}

TEST(MotionPlan, StaysWithinLimitsSpeedAndEffort) {
  const RobotDescription robot = pendulum();
  const MotionPlan plan = plan_of(robot);
  ASSERT_EQ(plan.joints.size(), 1U);
  const auto [least, most] = range_of(plan);
  EXPECT_GE(least, -1);
  EXPECT_LE(most, 1.2);
  EXPECT_GT(most - least, 0.3);
  EXPECT_LE(plan.joints[0].speed, kExcitationSpeed + 1e-6);
  EXPECT_LE(plan.joints[0].effort, kMaxEffort);
  EXPECT_TRUE(std::isfinite(plan.joints[0].condition));
  EXPECT_GT(plan.joints[0].condition, 1);
  EXPECT_NO_THROW(check_plan(plan, model_of(robot), "plan.yaml"));
}

// The bound of the plan, by a fall of the pendulum on its own: q'' = -g / l sin q, without friction.
TEST(MotionPlan, FallWithoutFrictionIsCaughtWithinSpeedAndInterval) {
  const MotionPlan plan = plan_of(pendulum());
  ASSERT_TRUE(plan.joints.at(0).release.has_value());
  const PlannedRelease& release = *plan.joints[0].release;
  constexpr double kCycle = 0.01, kFallStep = 1e-4, kSeen = 3 * kCycle;  // s
  double q = release.lift, v = 0, caught = -1;
  for (double t = 0; caught < 0 || t < caught + kSeen; t += kFallStep) {
    v -= kFallStep * 9.81 / 0.5 * std::sin(q);
    q += kFallStep * v;
    const bool over = q < release.lower || q > release.upper || std::abs(v) > release.speed;
    if (caught < 0 && (over || t > release.duration)) caught = t;
  }
  EXPECT_GT(caught, 0.05);
  EXPECT_GT(std::abs(q - release.lift), 0.05);
  EXPECT_LE(std::abs(v), kExcitationSpeed * 4);
  const auto [least, most] = range_of(plan);
  EXPECT_GT(q, least);
  EXPECT_LT(q, most);
  EXPECT_LE(release.duration, 2.0);
  EXPECT_LT(release.lower, release.lift - 0.02) << "room for the sag of the drive";
  EXPECT_GT(release.upper, release.lift + 0.02);
  EXPECT_GT(std::abs(9.81 * 0.5 * std::sin(release.lift)), 2.5 * 0.02 * 20)
      << "it falls in spite of friction";
}

TEST(MotionPlan, ReleaseIsLeftOutWithItsReason) {
  RobotDescription vertical = pendulum();
  vertical.joints[0].axis = Eigen::Vector3d(0, 0, 1);
  MotionPlan plan = plan_of(vertical);
  EXPECT_FALSE(plan.joints.at(0).release.has_value());
  EXPECT_THAT(plan.notes.back(), HasSubstr("'swing': lift and release are omitted: gravity has no moment"));
  RobotDescription stiff = pendulum();
  stiff.joints[0].dynamics.emplace().friction = 5;
  plan = plan_of(stiff);
  EXPECT_FALSE(plan.joints.at(0).release.has_value());
  EXPECT_THAT(plan.notes.back(), HasSubstr("so that it would not fall"));
  RobotDescription slow = pendulum();
  slow.joints[0].limits->velocity = 0.3;
  plan = plan_of(slow);
  EXPECT_FALSE(plan.joints.at(0).release.has_value());
  EXPECT_THAT(plan.notes.back(), HasSubstr("of its speed limit"));
}

TEST(MotionPlan, EditedReleaseIsRefused) {
  const RobotDescription robot = pendulum();
  const auto rule_with = [&](double PlannedRelease::*what, double value) {
    MotionPlan plan = plan_of(robot);
    (*plan.joints.at(0).release).*what = value;
    return rule_of([&] { check_plan(plan, model_of(robot), "plan.yaml"); });
  };
  EXPECT_EQ(rule_with(&PlannedRelease::lower, -1.1), "identify.plan");
  EXPECT_EQ(rule_with(&PlannedRelease::speed, 3), "identify.plan");
  EXPECT_EQ(rule_with(&PlannedRelease::duration, 2.5), "identify.plan");
  EXPECT_EQ(rule_with(&PlannedRelease::lift, std::nan("")), "identify.plan");
}

TEST(MotionPlan, PlanWithoutReleaseIsValid) {
  MotionPlan plan = plan_of(pendulum());
  plan.joints[0].release.reset();
  const auto file = std::filesystem::temp_directory_path() / "doppel_plan_without_release.yaml";
  std::ofstream(file) << to_yaml(plan);
  EXPECT_FALSE(read_motion_plan(file).joints.at(0).release.has_value());
  EXPECT_NO_THROW(check_plan(read_motion_plan(file), model_of(pendulum()), file.string()));
  std::filesystem::remove(file);
}

TEST(MotionPlan, SameArmGivesSamePlan) {
  EXPECT_EQ(to_yaml(plan_of(pendulum())), to_yaml(plan_of(pendulum())));
}

// Neighbours are not tested against each other, so that the ball is on the second link.
TEST(MotionPlan, ObstacleMakesMotionSmaller) {
  RobotDescription robot = test::make_double_pendulum(1.0, 0.5, 0.1, 0.3);
  for (Joint& joint : robot.joints) {
    joint.type = JointType::revolute;
    test::limit(joint, -1, 1.2, 20, 4);
  }
  Collision ball;
  ball.geometry = Sphere{0.05};
  ball.origin.xyz = Eigen::Vector3d(0, 0, -0.3);
  for (Link& link : robot.links) {
    if (link.name == robot.joints[1].child) link.collisions.push_back(ball);
  }
  // On the circle of the ball, 0.5 rad ahead.
  const Eigen::AngleAxisd ahead(0.5, robot.joints[0].axis.normalized());
  ball.origin.xyz = robot.joints[0].origin.xyz + ahead * Eigen::Vector3d(0, 0, -0.8);
  for (Link& link : robot.links) {
    if (link.name == robot.joints[0].parent) link.collisions.push_back(ball);
  }
  const MotionPlan plan = plan_of(robot);
  ASSERT_EQ(plan.joints.at(0).joint, "swing") << plan.notes.at(0);
  const auto [least, most] = range_of(plan);
  EXPECT_LT(most, 0.5 - 2 * std::asin(0.05 / 0.8));
  EXPECT_GT(most, 0.1);
}

TEST(MotionPlan, JointTooWeakForItsLoadIsLeftOut) {
  const RobotDescription robot = pendulum(0.3);  // 0.25 N m at 0.05 rad, the smallest motion
  try {
    plan_of(robot);
    FAIL();
  } catch (const InputError& problem) {
    EXPECT_EQ(problem.diagnostics().front().rule, "identify.no_plan");
    EXPECT_THAT(problem.diagnostics().front().message, HasSubstr("of its effort limit"));
  }
}

TEST(MotionPlan, PlanOfAnotherArmIsRefused) {
  const MotionPlan plan = plan_of(pendulum());
  RobotDescription other = pendulum();
  other.links[1].inertial->mass *= 1.2;
  EXPECT_EQ(rule_of([&] { check_plan(plan, model_of(other), "plan.yaml"); }), "identify.another_arm");
  other = pendulum();
  other.joints[0].limits->upper = 0.5;
  EXPECT_EQ(rule_of([&] { check_plan(plan, model_of(other), "plan.yaml"); }), "identify.another_arm");
}

TEST(MotionPlan, PlanThatLeavesLimitsIsRefused) {
  const RobotDescription robot = pendulum();
  MotionPlan plan = plan_of(robot);
  plan.joints[0].path[100].position = 1.3;
  EXPECT_EQ(rule_of([&] { check_plan(plan, model_of(robot), "plan.yaml"); }), "identify.plan");
  plan = plan_of(robot);
  plan.joints[0].path[100].time = plan.joints[0].path[99].time;
  EXPECT_EQ(rule_of([&] { check_plan(plan, model_of(robot), "plan.yaml"); }), "identify.plan");
}

TEST(MotionPlan, FileReadsBackAsWritten) {
  const MotionPlan plan = plan_of(pendulum());
  const auto file = std::filesystem::temp_directory_path() / "doppel_motion_plan_test.yaml";
  std::ofstream(file) << to_yaml(plan);
  EXPECT_EQ(to_yaml(read_motion_plan(file)), to_yaml(plan));
  EXPECT_NO_THROW(check_plan(read_motion_plan(file), model_of(pendulum()), file.string()));
  std::ofstream(file) << "version: 1\nrobot: [";
  EXPECT_EQ(rule_of([&] { read_motion_plan(file); }), "identify.plan");
  std::ofstream(file) << "version: 9\n";
  EXPECT_EQ(rule_of([&] { read_motion_plan(file); }), "identify.plan");
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace doppel
