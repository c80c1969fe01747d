// The controller of a base with one driven and steered wheel, by the cases of ros2_controllers 4.42 (ROS 2 Jazzy).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "doppel/control/controllers/detail/tricycle_limiter.h"
#include "doppel/control/controllers/test/base_rig.h"
#include "doppel/ros/messages/ackermann_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kRightAngle = std::numbers::pi / 2;
constexpr const char* kTricycle = "tricycle_controller/TricycleController";
const std::string kTricycleBase =
    "traction_joint_name: wheel, steering_joint_name: fork, wheelbase: 2.0, wheel_radius: 0.5";

struct TricycleRig : BaseRig {
  explicit TricycleRig(const std::string& more = "", bool starts = true)
      : BaseRig(kTricycle, kTricycleBase + more, base_hardware({"wheel"}, {"fork"})) {
    if (starts) start();
  }
  [[nodiscard]] double speed() const { return velocity("wheel"); }
  [[nodiscard]] double angle() const { return position("fork"); }
};

TEST(Tricycle, StraightAheadTurnsWheelBySpeed) {
  TricycleRig rig;
  rig.drive(1, 0, 0, 0.2);
  EXPECT_DOUBLE_EQ(rig.speed(), 2.0);
  EXPECT_DOUBLE_EQ(rig.angle(), 0.0);
}

TEST(Tricycle, CurveSteersByAtanOfWheelbaseOverRadius) {
  TricycleRig rig;
  rig.drive(1, 0, 0.25, 0.5);
  EXPECT_DOUBLE_EQ(rig.angle(), std::atan(0.5));
  EXPECT_DOUBLE_EQ(rig.speed(), 2.0 / std::cos(std::atan(0.5)));
}

TEST(Tricycle, TurnOnSpotSteersToRightAngle) {
  TricycleRig rig;
  rig.drive(0, 0, -0.5, 0.5);
  EXPECT_DOUBLE_EQ(rig.angle(), -kRightAngle);
  EXPECT_DOUBLE_EQ(rig.speed(), 2.0);
}

TEST(Tricycle, WheelIsSlowUntilAngleIsReached) {
  TricycleRig rig;
  rig.say(0, 0, 0.5);
  rig.run(1);  // the fork is still straight
  EXPECT_NEAR(rig.speed(), 0.0, 0.0201);
  rig.drive(0, 0, 0.5, 0.1);
  EXPECT_DOUBLE_EQ(rig.speed(), 2.0);
}

TEST(Tricycle, OdometryFollowsArc) {
  for (const char* mode : {"", ", open_loop: true"}) {
    TricycleRig rig(mode);
    rig.drive(1, 0, 0.25, 2.0);
    const auto& last = rig.odometry.back();
    EXPECT_NEAR(last.twist.twist.linear.x, 1.0, 1e-6) << mode;
    EXPECT_NEAR(last.twist.twist.angular.z, 0.25, 1e-6) << mode;
    const double yaw = 2 * std::atan2(last.pose.pose.orientation.z, last.pose.pose.orientation.w);
    EXPECT_NEAR(last.pose.pose.position.x, 4 * std::sin(yaw), 0.02) << mode;
    EXPECT_NEAR(last.pose.pose.position.y, 4 * (1 - std::cos(yaw)), 0.02) << mode;
  }
}

TEST(Tricycle, TransformIsSentOnRequestOnly) {
  TricycleRig rig;
  rig.run(5);
  EXPECT_GE(rig.odometry.size(), 4U) << "expected odometry before the first command";
  EXPECT_THAT(rig.transforms, IsEmpty());
  TricycleRig sending(", enable_odom_tf: true, odom_only_twist: true");
  sending.drive(1, 0, 0, 0.2);
  ASSERT_FALSE(sending.transforms.empty());
  EXPECT_GT(sending.transforms.back().transforms[0].transform.translation.x, 0.1);
  EXPECT_EQ(sending.odometry.back().pose.pose.position.x, 0.0);
  EXPECT_NEAR(sending.odometry.back().twist.twist.linear.x, 1.0, 0.2);
}

TEST(Tricycle, TimeoutBrakesThroughLimits) {
  TricycleRig rig(", cmd_vel_timeout: 100, traction: {max_deceleration: 10.0}");
  rig.drive(1, 0, 0, 0.5);
  EXPECT_DOUBLE_EQ(rig.speed(), 2.0);
  rig.run(21);  // half of that time at 10 rad/s^2
  EXPECT_GT(rig.speed(), 0.5);
  EXPECT_LT(rig.speed(), 1.5);
  rig.run(20);
  EXPECT_DOUBLE_EQ(rig.speed(), 0.0);
}

TEST(Tricycle, DeactivationStopsWheelStraight) {
  TricycleRig rig;
  rig.drive(1, 0, 0.25, 0.5);
  ASSERT_TRUE(rig.switch_to({}, {"base"}).ok());
  rig.run(1);
  EXPECT_EQ(rig.speed(), 0.0);
  EXPECT_EQ(rig.angle(), 0.0);
}

TEST(Tricycle, CommandOfWheelIsPublishedOnRequest) {
  TricycleRig rig(", publish_ackermann_command: true", false);
  std::vector<ackermann_msgs::msg::AckermannDrive> commands;
  rig.start();
  rig.node.subscribe<ackermann_msgs::msg::AckermannDrive>("/base/cmd_ackermann",
                                                          [&](const auto& m) { commands.push_back(m); });
  rig.drive(1, 0, 0.25, 0.5);
  ASSERT_FALSE(commands.empty());
  EXPECT_FLOAT_EQ(commands.back().steering_angle, static_cast<float>(std::atan(0.5)));
  EXPECT_FLOAT_EQ(commands.back().speed, static_cast<float>(rig.speed()));
}

TEST(Tricycle, MissingParameterIsRefused) {
  BaseRig joint(kTricycle, "traction_joint_name: wheel", base_hardware({"wheel"}, {"fork"}));
  EXPECT_THAT(input_error_of([&] { joint.start(); }), HasSubstr("'steering_joint_name' is not set"));
  BaseRig size(kTricycle, "traction_joint_name: wheel, steering_joint_name: fork, wheelbase: 1.0",
               base_hardware({"wheel"}, {"fork"}));
  EXPECT_THAT(input_error_of([&] { size.start(); }), HasSubstr("'wheel_radius' is not set"));
}

TEST(Tricycle, InvalidLimitsAreRefused) {
  TricycleRig rig(", traction: {max_velocity: -1.0}", false);
  EXPECT_THAT(input_error_of([&] { rig.start(); }) + rig.said(), HasSubstr("magnitudes for both directions"));
}

TEST(TricycleLimiter, MissingLimitHasItsDefault) {
  MagnitudeRange only_least{0.5, kNaN}, only_most{kNaN, 2.0}, crossed{2.0, 1.0}, none;
  EXPECT_TRUE(only_least.complete("a").ok());
  EXPECT_EQ(only_least.clamp(-0.1), -0.5);
  EXPECT_EQ(only_least.clamp(5000), 1000);
  EXPECT_TRUE(only_most.complete("a").ok());
  EXPECT_EQ(only_most.clamp(-3), -2.0);
  EXPECT_FALSE(crossed.complete("a").ok());
  EXPECT_TRUE(none.complete("a").ok());
  EXPECT_EQ(none.clamp(5000), 5000);
}

TEST(TricycleLimiter, DecelerationAppliesWhereMagnitudeFalls) {
  TractionLimits limits{{0, 10}, {0, 2}, {0, 8}, {}};
  ASSERT_TRUE(limits.complete().ok());
  EXPECT_DOUBLE_EQ(limits.limit(10, {5, 5}, 0.1), 5.2);
  EXPECT_DOUBLE_EQ(limits.limit(0, {5, 5}, 0.1), 4.2);
  EXPECT_DOUBLE_EQ(limits.limit(-10, {-5, -5}, 0.1), -5.2);
  EXPECT_DOUBLE_EQ(limits.limit(20, {10, 10}, 0.1), 10.0);
}

TEST(TricycleLimiter, SteeringIsLimitedBySpeedAndAngle) {
  SteeringLimits limits{kNaN, 0.5, {0, 1}, {}};
  ASSERT_TRUE(limits.complete().ok());
  EXPECT_DOUBLE_EQ(limits.limit(1, {0.2, 0.1}, 0.1), 0.3);
  EXPECT_DOUBLE_EQ(limits.limit(1, {0.45, 0.45}, 0.1), 0.5);
  EXPECT_DOUBLE_EQ(limits.limit(-1, {-0.45, -0.45}, 0.1), -0.5);
}

}  // namespace
}  // namespace doppel
