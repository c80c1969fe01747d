#include "doppel/twin/loop/rest_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/physics/contract/test/mobile_base.h"

namespace doppel {
namespace {

using test::Rig;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

RobotDescription bar(double effort) {
  RobotDescription robot;
  robot.name = "bar";
  robot.links = {test::make_frame("post"), test::make_link("bar", 2.0, {0.5, 0, 0}, {0.01, 0.01, 0.01})};
  robot.joints = {test::make_joint("hinge", JointType::revolute, "post", "bar", {0, 0, 2}, {0, 1, 0})};
  test::limit(robot.joints[0], -1.0, 1.0, effort, 3.0);
  return robot;
}

std::optional<RestReport> rest_of(const RobotDescription& robot, Rig& rig, double seconds = 0.5) {
  RestCheck check(rig.robot);
  rig.run(seconds);
  EXPECT_EQ(check.look(robot, rig.robot), seconds >= 0.5);
  return check.report();
}

TEST(RestCheck, HeldJointIsAtRest) {
  const RobotDescription robot = bar(100);
  Rig rig(robot);
  rig.hold_all();
  const auto report = rest_of(robot, rig);
  ASSERT_TRUE(report);
  EXPECT_THAT(report->unsettled, IsEmpty());
}

TEST(RestCheck, NothingIsReportedBeforeHalfSecond) {
  const RobotDescription robot = bar(100);
  Rig rig(robot);
  EXPECT_FALSE(rest_of(robot, rig, 0.4));
}

TEST(RestCheck, PassiveJointIsReportedWithItsLinkAndCause) {
  RobotDescription robot = bar(100);
  robot.joints[0].limits->lower = -100;
  robot.joints[0].limits->upper = 100;
  Rig rig(robot);
  const auto report = rest_of(robot, rig);
  ASSERT_TRUE(report);
  EXPECT_THAT(report->unsettled,
              ElementsAre(::testing::AllOf(HasSubstr("joint 'hinge' (link 'bar') moves at"),
                                           HasSubstr("no active controller commands it"))));
}

TEST(RestCheck, WeakDriveIsReportedAsCause) {
  const RobotDescription robot = bar(5);
  Rig rig(robot);
  rig.hold_all();
  const auto report = rest_of(robot, rig, 0.6);
  ASSERT_TRUE(report);
  ASSERT_EQ(report->unsettled.size(), 1u);
  EXPECT_THAT(report->unsettled[0], HasSubstr("its effort limit of 5 N m is too low for its load"));
}

TEST(RestCheck, EndOfShortRunReportsPresentState) {
  const RobotDescription robot = bar(100);
  Rig rig(robot);
  rig.hold_all();
  RestCheck check(rig.robot);
  rig.run(0.2);
  check.conclude(robot, rig.robot);
  ASSERT_TRUE(check.report());
  EXPECT_EQ(check.report()->time, rig.engine->time());
  EXPECT_FALSE(check.was_commanded());
  EXPECT_FALSE(check.look(robot, rig.robot));
}

TEST(RestCheck, JointWithoutCommandInterfaceIsNamedAsSuch) {
  RobotDescription robot = bar(100);
  robot.joints[0].limits->lower = -100;
  robot.joints[0].limits->upper = 100;
  HardwareJointDescription other;
  other.name = "other";
  other.command_interfaces.emplace_back().name = "position";
  robot.hardware.emplace_back().joints = {other};
  Rig rig(robot);
  const auto report = rest_of(robot, rig);
  ASSERT_TRUE(report);
  EXPECT_THAT(report->unsettled, ElementsAre(HasSubstr("it has no command interface in <ros2_control>")));
}

TEST(RestCheck, CommandedRobotIsNotChecked) {
  const RobotDescription robot = bar(100);
  Rig rig(robot);
  rig.hold_all();
  rig.robot.set_target(rig.joint("hinge"), 0.5);
  EXPECT_FALSE(rest_of(robot, rig));
}

// A joint that a controller holds by efforts is judged by the position that the controller follows.
TEST(RestCheck, JointHeldByEffortsIsJudged) {
  RobotDescription robot = bar(100);
  robot.joints[0].limits->lower = -100;
  robot.joints[0].limits->upper = 100;
  Rig rig(robot);
  rig.robot.set_drive(0, DriveMode::effort);
  rig.robot.set_target(0, 50.0);
  RestCheck check(rig.robot), of_goal(rig.robot), without(rig.robot);
  rig.run(0.5);
  EXPECT_TRUE(check.look(robot, rig.robot, [](int) { return 0.0; }));
  ASSERT_TRUE(check.report());
  ASSERT_EQ(check.report()->unsettled.size(), 1u);
  EXPECT_THAT(check.report()->unsettled[0], HasSubstr("check the gains of the controller"));
  EXPECT_TRUE(of_goal.look(robot, rig.robot, [](int) { return 0.5; }));
  EXPECT_FALSE(of_goal.report()) << "expected no report of a robot that follows a goal";
  EXPECT_TRUE(without.look(robot, rig.robot));
  EXPECT_FALSE(without.report()) << "expected no report of a robot that is commanded by efforts";
}

TEST(RestCheck, MimicOffItsLeaderIsDescribed) {
  UnsettledJoint finger;
  finger.joint = "finger_joint";
  finger.link = "finger";
  finger.strayed = 0.52;
  finger.cause = "it mimics 'synergy'";
  EXPECT_EQ(
      to_string(finger, false),
      "joint 'finger_joint' (link 'finger') stands 0.52 rad from the position that its leader gives: it "
      "mimics 'synergy'");
}

TEST(RestCheck, FallingBaseIsReported) {
  RobotDescription robot;
  robot.name = "body";
  robot.links = {test::make_link("body", 2.0, {0, 0, 0}, {0.01, 0.01, 0.01})};
  Rig rig(robot, test::empty_space(), {}, BaseKind::floating);
  const auto report = rest_of(robot, rig);
  ASSERT_TRUE(report);
  EXPECT_THAT(report->base, HasSubstr("it falls because it touches nothing"));
}

TEST(RestCheck, PassiveWheelMayTurnAndDrivenOneIsReported) {
  const auto unsettled_of = [](DriveMode mode) {
    RobotDescription robot = test::make_base();
    test::DrivenBase base(robot);
    const int left = base.joint("left_wheel_joint");
    base.robot.set_drive(left, mode);
    base.robot.set_drive(base.joint("right_wheel_joint"), DriveMode::velocity);
    std::vector<double> v(static_cast<std::size_t>(base.model.nv), 0.0);
    v[static_cast<std::size_t>(base.model.joints[static_cast<std::size_t>(left)].v)] = 1.0;
    base.robot.set_state(base.robot.q(), v);
    return find_unsettled_joints(robot, base.robot);
  };
  EXPECT_THAT(unsettled_of(DriveMode::passive), IsEmpty());
  const auto driven = unsettled_of(DriveMode::velocity);
  ASSERT_THAT(driven, ::testing::SizeIs(1));
  EXPECT_EQ(driven[0].joint, "left_wheel_joint");
}

TEST(RestCheck, JointBeyondItsLimitIsReported) {
  const RobotDescription robot = bar(100);
  Rig rig(robot);
  rig.set_state({1.2});
  const std::vector<UnsettledJoint> found = find_unsettled_joints(robot, rig.robot);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].beyond, 0.2, 1e-9);
  EXPECT_THAT(to_string(found[0], false), HasSubstr("stands 0.2 rad beyond its limit"));
}

}  // namespace
}  // namespace doppel
