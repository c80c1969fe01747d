// Mecanum and steering controllers against the kinematics of their wheels, and the behaviour that they share, by the
// cases of ros2_controllers 4.42 (ROS 2 Jazzy).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/detail/steering_geometry.h"
#include "doppel/control/controllers/test/base_rig.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using Names = std::vector<std::string>;

const Names kFour{"fl", "fr", "rr", "rl"};
const std::string kMecanumBase =
    "front_left_wheel_command_joint_name: fl, front_right_wheel_command_joint_name: fr, "
    "rear_right_wheel_command_joint_name: rr, rear_left_wheel_command_joint_name: rl, "
    "kinematics: {wheels_radius: 0.5, sum_of_robot_center_projection_on_X_Y_axis: 1.0";

struct MecanumRig : BaseRig {
  explicit MecanumRig(const std::string& more = "}, reference_timeout: 0.1")
      : BaseRig("mecanum_drive_controller/MecanumDriveController", kMecanumBase + more,
                base_hardware(kFour)) {}
  [[nodiscard]] std::vector<double> wheels() const {
    std::vector<double> out;
    for (const std::string& name : kFour) out.push_back(velocity(name));
    return out;
  }
};

TEST(MecanumDrive, WheelsFollowReference) {
  MecanumRig rig;
  rig.start();
  rig.say(1, 0, 0);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(2, 2, 2, 2));
  rig.say(0, 1, 0);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(-2, 2, -2, 2));
  rig.say(0, 0, 1);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(-2, 2, 2, -2));
}

TEST(MecanumDrive, AllWheelsStopWithoutReference) {
  MecanumRig rig(
      "}, reference_timeout: 0.1, linear: {x: {max_acceleration: 1000.0, max_deceleration: -0.1}}");
  rig.start();
  rig.drive(1, 0, 0, 0.5);
  EXPECT_THAT(rig.wheels(), ElementsAre(2, 2, 2, 2));
  rig.run(12);
  EXPECT_THAT(rig.wheels(), ElementsAre(0, 0, 0, 0));  // not through the limiter
  EXPECT_EQ(rig.count(Severity::warning, "no command for 0.1 s (reference_timeout)"), 1U) << rig.said();
}

TEST(MecanumDrive, TimeoutOfZeroUsesReferenceOnce) {
  MecanumRig rig("}");
  rig.start();
  rig.say(1, 0, 0);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(2, 2, 2, 2));
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(0, 0, 0, 0));
}

TEST(MecanumDrive, OdometryFollowsEveryDirection) {
  MecanumRig rig;
  rig.start();
  rig.drive(0.5, 0.2, 0.4, 2.0);
  const auto& last = rig.odometry.back();
  EXPECT_NEAR(last.twist.twist.linear.x, 0.5, 1e-9);
  EXPECT_NEAR(last.twist.twist.linear.y, 0.2, 1e-9);
  EXPECT_NEAR(last.twist.twist.angular.z, 0.4, 1e-9);
  const double yaw = 2 * std::atan2(last.pose.pose.orientation.z, last.pose.pose.orientation.w);
  EXPECT_NEAR(last.pose.pose.position.x, (0.5 * std::sin(yaw) - 0.2 * (1 - std::cos(yaw))) / 0.4, 1e-9);
  EXPECT_NEAR(last.pose.pose.position.y, (0.5 * (1 - std::cos(yaw)) + 0.2 * std::sin(yaw)) / 0.4, 1e-9);
  EXPECT_EQ(last.pose.covariance[0], 0.1);
  EXPECT_GT(rig.odometry.size(), 195U);  // at each update
}

TEST(MecanumDrive, BaseFrameMayBeElsewhere) {
  MecanumRig rig(", base_frame_offset: {x: 0.3, y: -0.2, theta: 0.7}}, reference_timeout: 0.1");
  rig.start();
  rig.drive(0.5, 0.2, 0.4, 1.0);
  EXPECT_NEAR(rig.odometry.back().twist.twist.linear.x, 0.5, 1e-9);
  EXPECT_NEAR(rig.odometry.back().twist.twist.linear.y, 0.2, 1e-9);
}

TEST(MecanumDrive, TransformIsOnItsOwnTopicAndReported) {
  MecanumRig rig;
  rig.start();
  rig.drive(0, 0, 0, 0.1);
  ASSERT_FALSE(rig.transforms.empty());
  EXPECT_EQ(rig.transforms[0].transforms[0].child_frame_id, "base_link");
  EXPECT_EQ(rig.count(Severity::note, "-r /base/tf_odometry:=/tf"), 1U) << rig.said();
  EXPECT_EQ(rig.manager->base_transform()->topic, "/base/tf_odometry");
}

TEST(MecanumDrive, MissingWheelIsRefused) {
  BaseRig rig("mecanum_drive_controller/MecanumDriveController", "front_left_wheel_command_joint_name: fl",
              base_hardware(kFour));
  EXPECT_THAT(input_error_of([&] { rig.start(); }),
              HasSubstr("'front_right_wheel_command_joint_name' is not set"));
  BaseRig twice("mecanum_drive_controller/MecanumDriveController",
                "front_left_wheel_command_joint_name: fl, front_right_wheel_command_joint_name: fl",
                base_hardware(kFour));
  EXPECT_THAT(input_error_of([&] { twice.start(); }), HasSubstr("is 'fl', which is another wheel, too"));
}

TEST(MecanumDrive, ReferencesAreThree) {
  MecanumRig rig;
  rig.start();
  EXPECT_THAT(rig.manager->controllers()[0].references,
              ElementsAre("linear/x/velocity", "linear/y/velocity", "angular/z/velocity"));
}

// -- steering

const std::string kAckermann =
    "traction_joints_names: [right, left], steering_joints_names: [right_steer, left_steer], wheelbase: 2.0, "
    "traction_track_width: 1.0, traction_wheels_radius: 0.5";

const FakeHardwareOptions kCar = base_hardware({"right", "left"}, {"right_steer", "left_steer"});

BaseRig ackermann(const std::string& more = "") {
  return {"ackermann_steering_controller/AckermannSteeringController", kAckermann + more, kCar};
}

// Each wheel of a car in a curve is perpendicular to the line to the centre of the turn and rolls by its distance.
TEST(AckermannSteering, WheelsRollAboutOneCentre) {
  BaseRig rig = ackermann();
  rig.start();
  rig.drive(1.0, 0, 0.25, 0.5);  // a turn of radius 4 m to the left, in the middle of the driven axle
  EXPECT_NEAR(rig.position("right_steer"), std::atan2(2.0, 4.5), 1e-9);
  EXPECT_NEAR(rig.position("left_steer"), std::atan2(2.0, 3.5), 1e-9);
  EXPECT_NEAR(rig.velocity("right"), 0.25 * 4.5 / 0.5, 1e-9);
  EXPECT_NEAR(rig.velocity("left"), 0.25 * 3.5 / 0.5, 1e-9);
  EXPECT_NEAR(rig.odometry.back().twist.twist.linear.x, 1.0, 1e-9);
  EXPECT_NEAR(rig.odometry.back().twist.twist.angular.z, 0.25, 1e-9);
}

TEST(AckermannSteering, SteeringStaysWithoutReference) {
  BaseRig rig = ackermann(", reference_timeout: 0.2");
  rig.start();
  rig.drive(1.0, 0, 0.25, 0.5);
  const double steering = rig.position("left_steer");
  rig.run(30);
  EXPECT_EQ(rig.velocity("right"), 0.0);
  EXPECT_EQ(rig.velocity("left"), 0.0);
  EXPECT_EQ(rig.position("left_steer"), steering);
}

TEST(AckermannSteering, NumberOfJointsIsChecked) {
  BaseRig rig(
      "ackermann_steering_controller/AckermannSteeringController",
      "traction_joints_names: [right], steering_joints_names: [right_steer, left_steer], wheelbase: 2.0",
      kCar);
  EXPECT_THAT(input_error_of([&] { rig.start(); }),
              HasSubstr("'traction_joints_names' has 1 joints, but this base has 2"));
}

TEST(AckermannSteering, DeprecatedNamesAreReportedAndUsed) {
  BaseRig rig(
      "ackermann_steering_controller/AckermannSteeringController",
      "rear_wheels_names: [right, left], front_wheels_names: [right_steer, left_steer], wheelbase: 2.0, "
      "rear_wheel_track: 1.0, rear_wheels_radius: 0.5",
      kCar);
  rig.start();
  rig.drive(1.0, 0, 0.25, 0.5);
  EXPECT_NEAR(rig.velocity("right"), 0.25 * 4.5 / 0.5, 1e-9);
  for (const char* old :
       {"rear_wheels_names", "front_wheels_names", "rear_wheel_track", "rear_wheels_radius"})
    EXPECT_EQ(rig.count(Severity::warning, "'" + std::string(old) + "' is deprecated"), 1U) << rig.said();
}

TEST(TricycleSteering, OneSteeredAndTwoDrivenWheels) {
  BaseRig rig("tricycle_steering_controller/TricycleSteeringController",
              "traction_joints_names: [right, left], steering_joints_names: [steer], wheelbase: 2.0, "
              "traction_track_width: 1.0, traction_wheels_radius: 0.5",
              base_hardware({"right", "left"}, {"steer"}));
  rig.start();
  rig.drive(1.0, 0, 0.25, 0.5);
  EXPECT_NEAR(rig.position("steer"), std::atan(0.5), 1e-9);
  EXPECT_NEAR(rig.velocity("right"), 0.25 * 4.5 / 0.5, 1e-9);
  EXPECT_NEAR(rig.odometry.back().twist.twist.angular.z, 0.25, 1e-9);
}

const std::string kBicycle =
    "traction_joints_names: [rear], steering_joints_names: [steer], wheelbase: 2.0, traction_wheel_radius: "
    "0.5";

TEST(BicycleSteering, WheelAndSteeringFollowReference) {
  for (const char* more : {"", ", open_loop: true"}) {
    BaseRig rig("bicycle_steering_controller/BicycleSteeringController", kBicycle + more,
                base_hardware({"rear"}, {"steer"}));
    rig.start();
    rig.drive(1.0, 0, 0.25, 1.0);
    EXPECT_NEAR(rig.velocity("rear"), 2.0, 1e-9);
    EXPECT_NEAR(rig.position("steer"), std::atan(0.5), 1e-9);
    EXPECT_NEAR(rig.odometry.back().twist.twist.linear.x, 1.0, 1e-9) << more;
    EXPECT_NEAR(rig.odometry.back().twist.twist.angular.z, 0.25, 1e-9) << more;
    EXPECT_EQ(rig.odometry.back().pose.covariance[7], 7.0);
  }
}

TEST(BicycleSteering, PositionsGiveOdometry) {
  BaseRig rig("bicycle_steering_controller/BicycleSteeringController", kBicycle + ", position_feedback: true",
              base_hardware({"rear"}, {"steer"}));
  rig.hardware->set_position("rear", 40);  // the first position is no displacement
  rig.start();
  for (int i = 1; i <= 50; ++i) {
    rig.drive(1.0, 0, 0, 0.01);
    rig.hardware->set_position("rear",
                               40 + 0.02 * i);  // the fake's wheel has a position command, too, and stays
  }
  rig.drive(1.0, 0, 0, 0.01);
  EXPECT_NEAR(rig.odometry.back().pose.pose.position.x, 50 * 0.02 * 0.5, 1e-9);
  EXPECT_NEAR(rig.odometry.back().twist.twist.linear.x, 1.0, 1e-9);
}

TEST(BicycleSteering, SpeedIsReducedUntilSteeringIsThere) {
  BaseRig rig("bicycle_steering_controller/BicycleSteeringController",
              kBicycle + ", reduce_wheel_speed_until_steering_reached: true",
              base_hardware({"rear"}, {"steer"}));
  rig.start();
  rig.hardware->block("steer");
  const double wanted = std::atan(1.0 * 2.0 / 1.0);
  rig.drive(1.0, 0, 1.0, 0.1);
  EXPECT_NEAR(rig.velocity("rear"), 2.0 * std::cos(wanted) / std::cos(M_PI / 6), 1e-9);
}

TEST(SteeringGeometry, WheelAnglesAreInverted) {
  const SteeringGeometry car{SteeringKind::ackermann, 2.5, 0.3, 1.4, 1.2};
  for (const double steering : {-0.6, -0.1, 0.0, 0.3}) {
    for (const double side : {-1.0, 1.0})
      EXPECT_NEAR(car.middle_angle(car.wheel_angle(steering, side), side), steering, 1e-12);
  }
}

}  // namespace
}  // namespace doppel
