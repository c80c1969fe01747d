// Which trajectories are accepted and which are rejected, and how they are sorted into the controller's joint
// order.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/detail/trajectory_message.h"
#include "doppel/control/controllers/test/jtc_rig.h"

namespace doppel::jtc {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const std::vector<std::string> kRevoluteJoints = {"Revolute 1", "Revolute 2", "Revolute 3"};

MessageRules rules() {
  MessageRules out;
  out.joints = kRevoluteJoints;
  return out;
}

// Why a message is rejected at t = 100 s; "" if it is accepted.
std::string error_of(const JointTrajectory& message, const MessageRules& by = rules()) {
  return check_message(message, by, time_from_seconds(100)).why();
}

JointTrajectory good() {
  return trajectory(kRevoluteJoints, {point(1, {1, 2, 3}), point(2, {0, 0, 0}, {0, 0, 0}, {1, 1, 1})});
}

TEST(JtcMessage, GoodMessageIsAccepted) {
  EXPECT_THAT(error_of(good()), IsEmpty());
}

// jtc.md, B16.
TEST(JtcMessage, PartialJointListIsRefusedUnlessAllowed) {
  JointTrajectory m = trajectory({"Revolute 1", "Revolute 3"}, {point(1, {1, 2})});
  EXPECT_THAT(error_of(m), AllOf(HasSubstr("'Revolute 2'"), HasSubstr("allow_partial_joints_goal")));
  MessageRules partial = rules();
  partial.allow_partial_joints = true;
  EXPECT_THAT(error_of(m, partial), IsEmpty());
}

// jtc.md, B17.
TEST(JtcMessage, UnknownJointIsReportedWithNearest) {
  JointTrajectory m = good();
  m.joint_names[1] = "Revolut 2";
  EXPECT_THAT(error_of(m), AllOf(HasSubstr("'Revolut 2'"), HasSubstr("did you mean 'Revolute 2'")));
}

// jtc.md, B17.
TEST(JtcMessage, RepeatedNamesAreAcceptedAndReported) {
  JointTrajectory m = good();
  m.joint_names[1] = "Revolute 1";
  EXPECT_THAT(error_of(m), IsEmpty());
  EXPECT_THAT(repeated_joints(m), ElementsAre("Revolute 1"));
  EXPECT_THAT(repeated_joints(good()), IsEmpty());
}

// jtc.md, B18.
TEST(JtcMessage, MessageWithoutNamesOrPointsIsRefused) {
  EXPECT_THAT(error_of(trajectory({}, {point(1, {})})), HasSubstr("lists no joints"));
  EXPECT_THAT(error_of(trajectory(kRevoluteJoints, {})), HasSubstr("does not stop the robot"));
}

// jtc.md, B19.
TEST(JtcMessage, LengthMismatchIsRefused) {
  JointTrajectory m = good();
  m.points[1].positions.pop_back();
  EXPECT_THAT(error_of(m), AllOf(HasSubstr("point 2 of 2"), HasSubstr("2 positions"), HasSubstr("3 joints")));
  m = good();
  m.points[0].velocities = {1};
  EXPECT_THAT(error_of(m), HasSubstr("1 velocities"));
  m = good();
  m.points[1].accelerations.push_back(1);
  EXPECT_THAT(error_of(m), HasSubstr("4 accelerations"));
}

// jtc.md, B20.
TEST(JtcMessage, MissingPositionsAreRefusedUnlessIntegrated) {
  JointTrajectory m = trajectory(kRevoluteJoints, {point(1, {}, {0, 0, 0})});
  EXPECT_THAT(error_of(m), HasSubstr("allow_integration_in_goal_trajectories"));
  MessageRules integrating = rules();
  integrating.allow_integration = true;
  EXPECT_THAT(error_of(m, integrating), IsEmpty());
  EXPECT_THAT(error_of(trajectory(kRevoluteJoints, {point(1, {}, {}, {0, 0, 0})}), integrating), IsEmpty());
  EXPECT_THAT(error_of(trajectory(kRevoluteJoints, {point(1, {})}), integrating),
              HasSubstr("neither positions"));
}

// jtc.md, B21.
TEST(JtcMessage, EffortWithoutEffortInterfaceIsRefused) {
  JointTrajectory m = trajectory(kRevoluteJoints, {point(1, {1, 1, 1}, {}, {}, {1, 1, 1})});
  EXPECT_THAT(error_of(m), HasSubstr("command_interfaces"));
  MessageRules effort = rules();
  effort.effort_commanded = true;
  EXPECT_THAT(error_of(m, effort), IsEmpty());
  m.points[0].effort.pop_back();
  EXPECT_THAT(error_of(m, effort), HasSubstr("2 effort"));
}

// jtc.md, B22.
TEST(JtcMessage, NonIncreasingTimeIsRefused) {
  JointTrajectory m = good();
  m.points[1].time_from_start = m.points[0].time_from_start;
  EXPECT_THAT(error_of(m), AllOf(HasSubstr("point 2 of 2"), HasSubstr("must increase")));
  m = good();
  m.points[0].time_from_start = to_duration_msg(from_seconds(-0.5));
  EXPECT_THAT(error_of(m), HasSubstr("negative"));
}

// jtc.md, B23.
TEST(JtcMessage, NonzeroEndVelocityIsRefusedUnlessAllowed) {
  JointTrajectory m = good();
  m.points[1].velocities[2] = 1e-6;
  EXPECT_THAT(error_of(m),
              AllOf(HasSubstr("'Revolute 3'"), HasSubstr("allow_nonzero_velocity_at_trajectory_end")));
  m.points[1].velocities[2] = 1e-8;
  EXPECT_THAT(error_of(m), IsEmpty());
  m.points[1].velocities[2] = -3;
  MessageRules moving = rules();
  moving.allow_nonzero_velocity_at_end = true;
  EXPECT_THAT(error_of(m, moving), IsEmpty());
}

// jtc.md, B24.
TEST(JtcMessage, PastTrajectoryIsRefused) {
  JointTrajectory m = good();
  m.header.stamp = to_time_msg(time_from_seconds(97));
  EXPECT_THAT(error_of(m), AllOf(HasSubstr("ends in the past"), HasSubstr("set the stamp to 0")));
}

// jtc.md, B25.
TEST(JtcMessage, LateTrajectoryIsAcceptedBeforeItsEnd) {
  JointTrajectory m = good();
  m.header.stamp = to_time_msg(time_from_seconds(98.5));
  EXPECT_THAT(error_of(m), IsEmpty());
  m.header.stamp = to_time_msg(time_from_seconds(200));
  EXPECT_THAT(error_of(m), IsEmpty());
}

TEST(JtcMessage, NanIsRefusedWithJointAndPoint) {
  for (const double bad : {std::nan(""), kInfinity, -kInfinity}) {
    JointTrajectory m = good();
    m.points[1].positions[1] = bad;
    EXPECT_THAT(error_of(m), AllOf(HasSubstr("'Revolute 2'"), HasSubstr("positions of point 2 of 2")));
    m = good();
    m.points[1].accelerations[0] = bad;
    EXPECT_THAT(error_of(m), AllOf(HasSubstr("'Revolute 1'"), HasSubstr("accelerations")));
    m = good();
    m.points[1].velocities[0] = bad;
    EXPECT_THAT(error_of(m), HasSubstr("velocities of point 2"));
  }
}

// jtc.md, B39.
TEST(JtcMessage, JointsAreReordered) {
  const auto made = make_trajectory(trajectory({"Revolute 3", "Revolute 1", "Revolute 2"},
                                               {point(1, {3, 1, 2}, {30, 10, 20}, {300, 100, 200})}),
                                    rules(), std::vector<double>{7, 8, 9});
  EXPECT_THAT(made->size(), 1u);
  JointStates s(3);
  made->begin(Time{}, Time{}, s, {});
  ASSERT_TRUE(made->sample(time_from_seconds(1), Interpolation::splines, s));
  EXPECT_THAT(s.positions, ElementsAre(1, 2, 3));
  EXPECT_THAT(s.velocities, ElementsAre(10, 20, 30));
  EXPECT_THAT(s.accelerations, ElementsAre(100, 200, 300));
}

// jtc.md, B40.
TEST(JtcMessage, MissingJointsHoldPosition) {
  const auto made = make_trajectory(trajectory({"Revolute 2"}, {point(1, {2}, {1}, {1})}), rules(),
                                    std::vector<double>{7, 8, 9});
  JointStates s(3);
  made->begin(Time{}, Time{}, s, {});
  ASSERT_TRUE(made->sample(time_from_seconds(1), Interpolation::splines, s));
  EXPECT_THAT(s.positions, ElementsAre(7, 2, 9));
  EXPECT_THAT(s.velocities, ElementsAre(0, 1, 0));
  EXPECT_THAT(s.accelerations, ElementsAre(0, 1, 0));
}

TEST(JtcMessage, MimicJointsAreIgnored) {
  MessageRules with_mimic = rules();
  with_mimic.ignored = {"finger"};
  JointTrajectory m = good();
  m.joint_names.push_back("finger");
  for (auto& p : m.points) {
    for (auto* field : {&p.positions, &p.velocities, &p.accelerations}) {
      if (!field->empty()) field->push_back(std::nan(""));
    }
  }
  EXPECT_THAT(error_of(m, with_mimic), IsEmpty());
  EXPECT_EQ(make_trajectory(m, with_mimic, std::vector<double>{0, 0, 0})->joints(), 3u);
  with_mimic.allow_partial_joints = true;
  EXPECT_THAT(error_of(trajectory({"finger"}, {point(1, {1})}), with_mimic), Not(IsEmpty()));
}

}  // namespace
}  // namespace doppel::jtc
