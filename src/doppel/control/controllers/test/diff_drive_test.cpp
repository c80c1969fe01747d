// The controller of a base with wheels on two sides, by the cases of the reference controller's own tests
// (ros2_controllers 4.42, ROS 2 Jazzy).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/test/base_rig.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

using geometry_msgs::msg::TwistStamped;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Names = std::vector<std::string>;

// A radius of 1 m, so that wheels turn at the speed of the base, unless the test's own parameters follow.
constexpr const char* kBase =
    "left_wheel_names: [l], right_wheel_names: [r], wheel_separation: 0.4, wheel_radius: 1.0";

constexpr const char* kDiffDrive = "diff_drive_controller/DiffDriveController";

FakeHardwareOptions wheels(Names states = {kPosition, kVelocity}) {
  FakeHardwareOptions options = base_hardware({"l", "r"});
  options.states = std::move(states);
  return options;
}

struct DiffRig : BaseRig {
  explicit DiffRig(const std::string& more = "", const FakeHardwareOptions& options = wheels(),
                   const std::string& base = kBase)
      : BaseRig(kDiffDrive, base + more, options) {
    node.subscribe<TwistStamped>("/base/cmd_vel_out", [this](const auto& m) { limited.push_back(m); });
  }
  void say(double linear, double angular, std::optional<Time> stamp = std::nullopt) {
    BaseRig::say(linear, 0, angular, stamp);
  }
  void drive(double linear, double angular, double seconds) { BaseRig::drive(linear, 0, angular, seconds); }
  [[nodiscard]] double left() const { return velocity("l"); }
  [[nodiscard]] double right() const { return velocity("r"); }

  std::vector<TwistStamped> limited;
};

double yaw_of(const geometry_msgs::msg::Quaternion& q) {
  return 2 * std::atan2(q.z, q.w);
}

std::string refusal_of(const std::string& parameters) {
  DiffRig rig("", wheels(), parameters);
  return input_error_of([&] { rig.start(); });
}

// -- D1: what it needs, what it claims

TEST(DiffDrive, MissingOrUnequalWheelsAreRefused) {
  EXPECT_THAT(refusal_of("wheel_separation: 0.4, wheel_radius: 1.0"),
              HasSubstr("'left_wheel_names' is empty"));
  EXPECT_THAT(refusal_of("left_wheel_names: [l], wheel_separation: 0.4, wheel_radius: 1.0"),
              HasSubstr("'right_wheel_names' is empty"));
  EXPECT_THAT(
      refusal_of(
          "left_wheel_names: [l, r], right_wheel_names: [r], wheel_separation: 0.4, wheel_radius: 1.0"),
      HasSubstr("'right_wheel_names' has 1 names, but 'left_wheel_names' has 2"));
  EXPECT_THAT(
      refusal_of("left_wheel_names: [l], right_wheel_names: [l], wheel_separation: 0.4, wheel_radius: 1.0"),
      HasSubstr("also a left wheel"));
  EXPECT_THAT(
      refusal_of("left_wheel_names: [l], right_wheel_names: [rr], wheel_separation: 0.4, wheel_radius: 1.0"),
      HasSubstr("did you mean 'r'?"));
}

TEST(DiffDrive, SizesHaveToBePositive) {
  EXPECT_THAT(refusal_of("left_wheel_names: [l], right_wheel_names: [r], wheel_radius: 1.0"),
              HasSubstr("'wheel_separation' is not set"));
  EXPECT_THAT(
      refusal_of("left_wheel_names: [l], right_wheel_names: [r], wheel_separation: 0.4, wheel_radius: -1.0"),
      HasSubstr("'wheel_radius': it must be above 0"));
  EXPECT_THAT(refusal_of(std::string(kBase) + ", linear: {x: {max_velocity: -1.0}}"),
              HasSubstr("'linear.x.max_velocity': it must be at least 0, or NaN"));
  EXPECT_THAT(refusal_of(std::string(kBase) + ", pose_covariance_diagonal: [0.1]"),
              HasSubstr("it has 1 values"));
}

TEST(DiffDrive, InterfacesFollowFeedback) {
  const auto states_for = [](const std::string& more) {
    DiffRig rig(more);
    rig.start();
    EXPECT_THAT(rig.manager->controllers()[0].claimed, ElementsAre("l/velocity", "r/velocity"));
    return rig.manager->controllers()[0].required_states;
  };
  EXPECT_THAT(states_for(""), ElementsAre("l/position", "r/position"));
  EXPECT_THAT(states_for(", position_feedback: false"), ElementsAre("l/velocity", "r/velocity"));
  EXPECT_THAT(states_for(", open_loop: true"), IsEmpty());
}

TEST(DiffDrive, MissingFeedbackIsRefused) {
  DiffRig rig("", wheels({kVelocity}));
  EXPECT_THAT(input_error_of([&] { rig.start(); }), HasSubstr("requires the state interface 'l/position'"));
  DiffRig open(", open_loop: true", wheels({}));
  open.start();
  EXPECT_EQ(open.state_of("base"), ControllerState::active);
}

// -- D2: commands, their age

TEST(DiffDrive, CommandDrivesBothWheels) {
  DiffRig rig;
  rig.start();
  rig.say(1.0, 0.0);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.left(), 1.0);
  EXPECT_DOUBLE_EQ(rig.right(), 1.0);
  rig.say(0.0, 1.0);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.left(), -0.2);
  EXPECT_DOUBLE_EQ(rig.right(), 0.2);
}

TEST(DiffDrive, StampAheadDoesNotTimeOutAndIsReportedOnce) {
  DiffRig rig;
  rig.now = time_from_seconds(100);
  rig.start();
  for (int i = 0; i < 3; ++i) {
    rig.say(1.0, 0.0, time_from_seconds(1.7e9));
    rig.run(1);
  }
  rig.now += from_seconds(10);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.left(), 1.0) << "expected the age of ros2_controllers, which is negative";
  EXPECT_EQ(rig.count(Severity::warning, "s ahead"), 1U) << rig.said();
}

TEST(DiffDrive, StampZeroIsNowAndReportedOnce) {
  DiffRig rig;
  rig.now = time_from_seconds(100);
  rig.start();
  for (int i = 0; i < 3; ++i) {
    rig.say(1.0, 0.0, Time{});
    rig.run(1);
  }
  EXPECT_DOUBLE_EQ(rig.left(), 1.0);
  EXPECT_EQ(rig.count(Severity::note, "stamp 0"), 1U) << rig.said();
}

TEST(DiffDrive, OldCommandIsRefused) {
  DiffRig rig;
  rig.now = time_from_seconds(100);
  rig.start();
  rig.say(1.0, 0.0, rig.now - from_seconds(0.5));
  rig.run(1);
  EXPECT_TRUE(std::isnan(rig.left()));
  EXPECT_EQ(rig.count(Severity::warning, "commands are refused: a stamp is 0.500 s old"), 1U) << rig.said();
  rig.say(1.0, 0.0, rig.now - from_seconds(0.4));
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.left(), 1.0);
}

TEST(DiffDrive, EndOfCommandsBrakesThroughLimiter) {
  DiffRig rig(", linear: {x: {max_acceleration: 2.0, max_deceleration: -4.0}}");
  rig.start();
  rig.drive(1.0, 0.0, 1.0);
  EXPECT_DOUBLE_EQ(rig.left(), 1.0);
  rig.run(50);  // 0.5 s after the last command it is not yet older than the time-out
  EXPECT_DOUBLE_EQ(rig.left(), 1.0);
  rig.run(1);
  EXPECT_NEAR(rig.left(), 0.96, 1e-12);
  rig.run(24);
  EXPECT_NEAR(rig.left(), 0.0, 1e-12);
  rig.run(10);
  EXPECT_EQ(rig.count(Severity::warning, "no command for 0.5 s (cmd_vel_timeout): the base brakes"), 1U)
      << rig.said();
}

TEST(DiffDrive, RestWithoutCommandsIsNotReported) {
  DiffRig rig;
  rig.start();
  rig.run(100);
  rig.say(0.0, 0.0);
  rig.run(100);
  EXPECT_EQ(rig.count(Severity::warning, "the base brakes"), 0U) << rig.said();
}

TEST(DiffDrive, TimeoutOfZeroKeepsCommand) {
  DiffRig rig(", cmd_vel_timeout: 0.0");
  rig.now = time_from_seconds(100);
  rig.start();
  rig.say(1.0, 0.0, time_from_seconds(1));
  rig.run(1000);
  EXPECT_DOUBLE_EQ(rig.left(), 1.0);
}

TEST(DiffDrive, NanCommandLeavesReference) {
  DiffRig rig;
  rig.start();
  rig.say(1.0, 0.0);
  rig.run(1);
  rig.say(kNaN, 0.5);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.left(), 1.0);
  EXPECT_EQ(rig.manager->reference("linear/velocity"), 1.0);
}

// -- D3: references

TEST(DiffDrive, NothingIsWrittenOrPublishedBeforeFirstCommand) {
  DiffRig rig;
  rig.start();
  rig.run(20);
  EXPECT_TRUE(std::isnan(rig.manager->reference("linear/velocity")));
  EXPECT_TRUE(std::isnan(rig.manager->reference("angular/velocity")));
  EXPECT_TRUE(std::isnan(rig.left()));
  EXPECT_THAT(rig.odometry, IsEmpty());
  EXPECT_THAT(rig.transforms, IsEmpty());
  rig.run(40);  // the time-out counts from the activation: at rest there is odometry, too
  EXPECT_EQ(rig.manager->reference("linear/velocity"), 0.0);
  EXPECT_GT(rig.odometry.size(), 0U);
  EXPECT_GT(rig.transforms.size(), 0U);
}

TEST(DiffDrive, LeaderCommandsReferences) {
  const std::string yaml = R"(controller_manager:
  ros__parameters:
    base: {type: diff_drive_controller/DiffDriveController}
    forward: {type: forward_command_controller/ForwardCommandController}
forward: {ros__parameters: {joints: [base/linear, base/angular], interface_name: velocity}}
base: {ros__parameters: {)" +
                           std::string(kBase) + "}}\n";
  ManagerRig rig(yaml, continuous_joints({"l", "r"}), wheels());
  for (const char* name : {"base", "forward"}) {
    rig.manager->load(name);
    ASSERT_TRUE(rig.manager->configure(name).ok()) << rig.said();
  }
  EXPECT_THAT(rig.manager->controllers()[0].references, ElementsAre("linear/velocity", "angular/velocity"));
  ASSERT_TRUE(rig.switch_to({"base", "forward"}).ok());
  rig.run(2);
  EXPECT_TRUE(std::isnan(rig.hardware->last_command("l/velocity")));
  rig.say<std_msgs::msg::Float64MultiArray>("/forward/commands", {{}, {3.0, 0.0}});
  rig.run(200);  // no time-out in a chain
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("l/velocity"), 3.0);
  rig.say<TwistStamped>("/base/cmd_vel", {{}, {{1, 0, 0}, {}}});
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("l/velocity"), 3.0);
  ASSERT_TRUE(rig.switch_to({}, {"forward"}).ok());
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("l/velocity"), 0.0);
}

// -- D4: kinematics and limits

TEST(DiffDrive, MultipliersCorrectSizes) {
  DiffRig rig(
      ", wheel_separation_multiplier: 1.5, left_wheel_radius_multiplier: 2.0, "
      "right_wheel_radius_multiplier: 0.5");
  rig.start();
  rig.say(1.0, 2.0);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.left(), (1.0 - 2.0 * 0.6 / 2) / 2.0);
  EXPECT_DOUBLE_EQ(rig.right(), (1.0 + 2.0 * 0.6 / 2) / 0.5);
}

TEST(DiffDrive, EachDirectionHasItsAcceleration) {
  DiffRig rig(
      ", linear: {x: {max_acceleration: 2.0, max_deceleration: -4.0, max_acceleration_reverse: -8.0, "
      "max_deceleration_reverse: 10.0}}, cmd_vel_timeout: 0.0");
  rig.start();
  rig.say(0, 0);
  rig.run(3);
  // The number of cycles until the wheels have the velocity, at 100 Hz.
  const auto cycles_to = [&](double linear) {
    rig.say(linear, 0);
    int cycles = 0;
    do {
      rig.run(1);
      ++cycles;
    } while (std::abs(rig.left() - linear) > 1e-9 && cycles < 1000);
    EXPECT_DOUBLE_EQ(rig.left(), rig.right());
    return cycles;
  };
  EXPECT_EQ(cycles_to(1.0), 50);
  EXPECT_EQ(cycles_to(0.0), 25);
  EXPECT_EQ(cycles_to(-1.0), 13);  // 0.125 s
  EXPECT_EQ(cycles_to(0.0), 10);
}

TEST(DiffDrive, VelocityIsLimited) {
  DiffRig rig(
      ", linear: {x: {max_velocity: 0.5, min_velocity: -0.25}}, angular: {z: {max_velocity: 1.0}}, "
      "publish_limited_velocity: true");
  rig.start();
  rig.say(2.0, 9.0);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.right(), 0.5 + 0.2);
  rig.say(-2.0, -9.0);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.right(), -0.25 - 0.2);
  rig.run(3);
  ASSERT_THAT(rig.limited, SizeIs(5));  // D8: at each update
  EXPECT_DOUBLE_EQ(rig.limited[0].twist.linear.x, 0.5);
  EXPECT_DOUBLE_EQ(rig.limited[0].twist.angular.z, 1.0);
  EXPECT_DOUBLE_EQ(rig.limited[4].twist.linear.x, -0.25);
}

TEST(DiffDrive, InconsistentLimitsAreRefused) {
  DiffRig rig(", linear: {x: {max_acceleration: 1.0, max_deceleration_reverse: 0.0, max_deceleration: 0.0}}");
  rig.start();  // both zero is allowed: the base does not brake
  EXPECT_EQ(rig.state_of("base"), ControllerState::active);
}

// -- D5: odometry

TEST(DiffDrive, CircleIsExact) {
  DiffRig rig;
  rig.start();
  rig.drive(0.5, 0.5, 4.0);
  ASSERT_FALSE(rig.odometry.empty());
  const auto& last = rig.odometry.back();
  const double t = to_seconds(from_msg(last.header.stamp)), yaw = 0.5 * t;
  EXPECT_NEAR(last.pose.pose.position.x, std::sin(yaw), 1e-9);
  EXPECT_NEAR(last.pose.pose.position.y, 1 - std::cos(yaw), 1e-9);
  EXPECT_NEAR(yaw_of(last.pose.pose.orientation), yaw, 1e-9);
  EXPECT_NEAR(last.twist.twist.linear.x, 0.5, 1e-9);
  EXPECT_NEAR(last.twist.twist.angular.z, 0.5, 1e-9);
  EXPECT_EQ(last.header.frame_id, "odom");
  EXPECT_EQ(last.child_frame_id, "base_link");
}

TEST(DiffDrive, TwistIsMeanOfTenVelocities) {
  DiffRig rig(", publish_rate: 100.0");
  rig.start();
  rig.drive(0.0, 0.0, 0.2);
  rig.drive(1.0, 0.0, 0.05);
  // The fake wheels move after the update: 4 of the last 10 velocities are 1.
  EXPECT_NEAR(rig.odometry.back().twist.twist.linear.x, 0.4, 1e-9);
}

TEST(DiffDrive, VelocityFeedbackIsIntegrated) {
  DiffRig rig(", position_feedback: false, publish_rate: 100.0");
  rig.start();
  rig.say(0, 0);
  rig.hardware->block("l");
  rig.hardware->block("r");
  rig.run(1);
  rig.hardware->set_velocity("l", 1.0);
  rig.hardware->set_velocity("r", 2.0);
  const std::size_t before = rig.odometry.size();
  rig.run(2);
  EXPECT_EQ(rig.odometry.size(), before + 2);
}

TEST(DiffDrive, OpenLoopFollowsLimitedCommand) {
  DiffRig rig(", open_loop: true, linear: {x: {max_velocity: 0.5}}, publish_rate: 100.0", wheels({}));
  rig.start();
  rig.drive(5.0, 0.0, 1.0);
  EXPECT_NEAR(rig.odometry.back().pose.pose.position.x, 0.5, 1e-9);
  EXPECT_NEAR(rig.odometry.back().twist.twist.linear.x, 0.5, 1e-9);
}

TEST(DiffDrive, FirstPositionOfWheelIsNoDisplacement) {
  DiffRig rig;
  rig.hardware->set_position("l", 100);
  rig.hardware->set_position("r", -50);
  rig.start();
  rig.drive(0, 0, 0.1);
  EXPECT_EQ(rig.odometry.back().pose.pose.position.x, 0.0);
  EXPECT_EQ(rig.odometry.back().pose.pose.orientation.z, 0.0);
}

TEST(DiffDrive, OdometryIsPublishedAtItsRate) {
  DiffRig rig;
  rig.start();
  rig.drive(1, 0, 2.0);
  EXPECT_EQ(rig.odometry.size(), 100U);
  EXPECT_EQ(rig.transforms.size(), 100U);
  ASSERT_THAT(rig.transforms[0].transforms, SizeIs(1));
  EXPECT_EQ(rig.transforms[0].transforms[0].header.frame_id, "odom");
  EXPECT_EQ(rig.transforms[0].transforms[0].child_frame_id, "base_link");
  EXPECT_EQ(rig.transforms.back().transforms[0].transform.translation.x,
            rig.odometry.back().pose.pose.position.x);
  DiffRig uneven(", publish_rate: 30.0, enable_odom_tf: false");
  uneven.start();
  uneven.drive(1, 0, 10.0);
  EXPECT_NEAR(static_cast<double>(uneven.odometry.size()), 300, 1);
  EXPECT_THAT(uneven.transforms, IsEmpty());
}

TEST(DiffDrive, CovariancesAreOnDiagonals) {
  DiffRig rig(
      ", pose_covariance_diagonal: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], twist_covariance_diagonal: [6.0, 5.0, "
      "4.0, "
      "3.0, 2.0, 1.0]");
  rig.start();
  rig.drive(0, 0, 0.1);
  const auto& message = rig.odometry.back();
  for (std::size_t i = 0; i < 36; ++i) {
    const bool diagonal = i % 7 == 0;
    EXPECT_EQ(message.pose.covariance[i], diagonal ? static_cast<double>(i / 7 + 1) : 0);
    EXPECT_EQ(message.twist.covariance[i], diagonal ? static_cast<double>(6 - i / 7) : 0);
  }
}

TEST(DiffDrive, PoseSurvivesDeactivationAndNotConfiguration) {
  DiffRig rig;
  rig.start();
  rig.drive(1, 0, 1.0);
  const double x = rig.odometry.back().pose.pose.position.x;
  ASSERT_TRUE(rig.switch_to({}, {"base"}).ok());
  ASSERT_TRUE(rig.switch_to({"base"}, {}).ok());
  rig.drive(0, 0, 0.1);
  EXPECT_NEAR(rig.odometry.back().pose.pose.position.x, x, 0.03);
  ASSERT_TRUE(rig.switch_to({}, {"base"}).ok());
  ASSERT_TRUE(rig.manager->configure("base").ok());
  ASSERT_TRUE(rig.switch_to({"base"}, {}).ok());
  rig.drive(0, 0, 0.1);
  EXPECT_EQ(rig.odometry.back().pose.pose.position.x, 0.0);
}

TEST(DiffDrive, ServiceSetsOdometry) {
  DiffRig rig;
  rig.start();
  using control_msgs::srv::SetOdometry;
  SetOdometry::Request request;
  request.x = 2;
  request.y = -1;
  request.yaw = 0.5;
  EXPECT_TRUE(rig.call<SetOdometry>("/base/set_odometry", request).success);
  rig.drive(0, 0, 0.1);
  EXPECT_NEAR(rig.odometry.back().pose.pose.position.x, 2, 1e-12);
  EXPECT_NEAR(rig.odometry.back().pose.pose.position.y, -1, 1e-12);
  EXPECT_NEAR(yaw_of(rig.odometry.back().pose.pose.orientation), 0.5, 1e-12);
}

// -- D6: frames

TEST(DiffDrive, FramePrefixFollowsParametersAndNamespace) {
  struct Case {
    const char *parameters, *name_space, *frame;
  };
  const Case cases[] = {{"tf_frame_prefix_enable: false, tf_frame_prefix: test_prefix", "", "odom"},
                        {"tf_frame_prefix: test_prefix", "", "test_prefix/odom"},
                        {"tf_frame_prefix: ''", "", "odom"},
                        {"tf_frame_prefix_enable: false, tf_frame_prefix: test_prefix", "/left", "odom"},
                        {"tf_frame_prefix: test_prefix", "/left", "test_prefix/odom"},
                        {"tf_frame_prefix: ''", "/left", "left/odom"},
                        {"tf_frame_prefix: /a/", "/left", "a/odom"},
                        {"tf_frame_prefix: '~'", "/left", "left/odom"},
                        {"tf_frame_prefix: '~'", "", "odom"}};
  for (const Case& c : cases) {
    ControllerManagerOptions options;
    options.name_space = c.name_space;
    const std::string yaml = "/**" +
                             std::string(
                                 "/controller_manager: {ros__parameters: {base: {type: "
                                 "diff_drive_controller/DiffDriveController}}}\n/**/base: "
                                 "{ros__parameters: {") +
                             kBase + ", " + c.parameters + "}}\n";
    ManagerRig rig(yaml, continuous_joints({"l", "r"}), wheels(), options);
    const Recorder<nav_msgs::msg::Odometry> recorder(rig.bus, std::string(c.name_space) + "/base/odom");
    const auto& odometry = recorder.messages;
    rig.start({"base"});
    rig.run(60);
    ASSERT_FALSE(odometry.empty()) << c.parameters << rig.said();
    EXPECT_EQ(odometry[0].header.frame_id, c.frame) << c.parameters;
    EXPECT_THAT(odometry[0].child_frame_id, testing::EndsWith("base_link"));
  }
}

TEST(DiffDrive, BaseFrameBelowRootIsReported) {
  DiffRig rig(", base_frame_id: l_link");
  rig.start();
  EXPECT_EQ(rig.count(Severity::warning, "the root link is 'base_link'"), 1U) << rig.said();
}

// -- D7: deactivation

TEST(DiffDrive, DeactivationStopsWheelsAndForgetsCommand) {
  DiffRig rig(", cmd_vel_timeout: 0.0");
  rig.start();
  rig.say(1, 1);
  rig.run(1);
  EXPECT_GT(rig.right(), 0);
  ASSERT_TRUE(rig.switch_to({}, {"base"}).ok());
  EXPECT_EQ(rig.hardware->command_at_release("l/velocity"), 0.0);
  EXPECT_EQ(rig.hardware->command_at_release("r/velocity"), 0.0);
  rig.say(1, 1);  // not accepted while inactive
  ASSERT_TRUE(rig.switch_to({"base"}, {}).ok());
  EXPECT_TRUE(std::isnan(rig.manager->reference("linear/velocity")));
  rig.run(5);
  EXPECT_TRUE(std::isnan(rig.left()));  // nothing new was commanded
  rig.say(1, 0);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.left(), 1.0);
}

// -- D9: deprecated parameters

TEST(DiffDrive, DeprecatedParametersAreReportedAndObeyed) {
  DiffRig rig(", linear: {x: {max_velocity: 0.5, has_velocity_limits: false, min_acceleration: -1.0}}");
  rig.start();
  EXPECT_EQ(rig.count(Severity::warning, "'linear.x.has_velocity_limits' is deprecated: its limits are off"),
            1U)
      << rig.said();
  EXPECT_EQ(rig.count(Severity::warning, "'linear.x.min_acceleration' is deprecated"), 1U) << rig.said();
  rig.say(2, 0);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.left(), 2.0);
}

TEST(DiffDrive, DeprecatedParametersThatAreNotWrittenAreNotReported) {
  DiffRig rig;
  rig.start();
  EXPECT_EQ(rig.count(Severity::warning, ""), 0U) << rig.said();
}

TEST(DiffDrive, InvalidStateStopsWheels) {
  DiffRig rig;
  rig.start();
  rig.say(1, 0);
  rig.run(1);
  rig.hardware->set_position("l", kNaN);
  rig.say(1, 0);
  rig.run(30);
  EXPECT_EQ(rig.right(), 0.0);
  EXPECT_EQ(rig.count(Severity::error, "a wheel's state is not a number"), 1U) << rig.said();
}

}  // namespace
}  // namespace doppel
