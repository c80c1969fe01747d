// The controller of a base on omni wheels against their kinematics, by the cases of ros2_controllers (6.9, the same in
// ROS 2 Jazzy).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "doppel/control/controllers/test/base_rig.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using Names = std::vector<std::string>;

constexpr const char* kOmni = "omni_wheel_drive_controller/OmniWheelDriveController";
const std::string kOmniBase = "robot_radius: 0.5, wheel_radius: 0.1";

struct OmniRig : BaseRig {
  explicit OmniRig(const std::string& more = "", Names wheel_joints = {"a", "b", "c", "d"},
                   const std::string& offset = "0.0")
      : BaseRig(
            kOmni,
            kOmniBase + ", wheel_offset: " + offset + ", wheel_names: [" + joined(wheel_joints) + "]" + more,
            base_hardware(wheel_joints)),
        joints(std::move(wheel_joints)) {
    start();
  }
  static std::string joined(const Names& names) {
    std::string out;
    for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
    return out;
  }
  [[nodiscard]] std::vector<double> wheels() const {
    std::vector<double> out;
    for (const std::string& name : joints) out.push_back(std::round(1e9 * velocity(name)) / 1e9 + 0.0);
    return out;
  }

  Names joints;
};

TEST(OmniWheelDrive, WheelsFollowCommand) {
  OmniRig rig;
  rig.say(1, 0, 0);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(0, 10, 0, -10));
  rig.say(0, 1, 0);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(-10, 0, 10, 0));
  rig.say(0, 0, 1);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(-5, -5, -5, -5));
}

TEST(OmniWheelDrive, FirstWheelMayBeElsewhere) {
  OmniRig rig("", {"a", "b", "c"}, "1.5707963267948966");
  rig.say(1, 0, 0);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(10, -5, -5));
}

TEST(OmniWheelDrive, OdometryFollowsEveryDirection) {
  for (const char* feedback : {"", ", position_feedback: false", ", open_loop: true"}) {
    OmniRig rig(feedback, {"a", "b", "c"});
    rig.drive(0.5, 0.2, 0.4, 2.0);
    const auto& last = rig.odometry.back();
    EXPECT_NEAR(last.twist.twist.linear.x, 0.5, 1e-9) << feedback;
    EXPECT_NEAR(last.twist.twist.linear.y, 0.2, 1e-9) << feedback;
    EXPECT_NEAR(last.twist.twist.angular.z, 0.4, 1e-9) << feedback;
    const double yaw = 2 * std::atan2(last.pose.pose.orientation.z, last.pose.pose.orientation.w);
    EXPECT_GT(yaw, 0.78) << feedback;
    EXPECT_NEAR(last.pose.pose.position.x, (0.5 * std::sin(yaw) - 0.2 * (1 - std::cos(yaw))) / 0.4, 1e-9);
    EXPECT_NEAR(last.pose.pose.position.y, (0.5 * (1 - std::cos(yaw)) + 0.2 * std::sin(yaw)) / 0.4, 1e-9);
    EXPECT_GT(rig.odometry.size(), 195U) << "expected it at each update";
  }
}

TEST(OmniWheelDrive, NoOdometryBeforeFirstCommand) {
  OmniRig rig;
  rig.run(20);
  EXPECT_THAT(rig.odometry, SizeIs(0));
  rig.say(0.1, 0, 0);
  rig.run(1);
  EXPECT_THAT(rig.odometry, SizeIs(1));
  ASSERT_THAT(rig.transforms, SizeIs(1));
  EXPECT_EQ(rig.transforms[0].transforms[0].child_frame_id, "base_link");
}

TEST(OmniWheelDrive, WheelsStopAfterTimeout) {
  OmniRig rig;
  rig.drive(1, 0, 0, 0.3);
  EXPECT_THAT(rig.wheels(), ElementsAre(0, 10, 0, -10));
  rig.run(52);
  EXPECT_THAT(rig.wheels(), ElementsAre(0, 0, 0, 0));
  EXPECT_EQ(rig.count(Severity::warning, "no command for 0.5 s (cmd_vel_timeout)"), 1U) << rig.said();
}

TEST(OmniWheelDrive, CommandThatIsNoNumberIsNotUsed) {
  OmniRig rig;
  rig.say(1, 0, 0);
  rig.run(1);
  rig.say(1, kNaN, 0);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(0, 10, 0, -10));
}

TEST(OmniWheelDrive, DeactivationStopsWheels) {
  OmniRig rig;
  rig.drive(1, 0, 0, 0.1);
  ASSERT_TRUE(rig.switch_to({}, {"base"}).ok());
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(0, 0, 0, 0));
}

TEST(OmniWheelDrive, CovariancesAreItsOwnParameters) {
  OmniRig rig(
      ", diagonal_covariance: {pose: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], twist: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]}");
  rig.drive(0, 0, 0, 0.05);
  EXPECT_EQ(rig.odometry.back().pose.covariance[7], 2.0);
  EXPECT_EQ(rig.odometry.back().twist.covariance[35], 0.6);
}

TEST(OmniWheelDrive, TimeoutOfZeroIsReportedAndUsesCommandOnce) {
  OmniRig rig(", cmd_vel_timeout: 0.0");
  rig.say(1, 0, 0);
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(0, 10, 0, -10));
  rig.run(1);
  EXPECT_THAT(rig.wheels(), ElementsAre(0, 0, 0, 0));
  EXPECT_EQ(rig.count(Severity::warning, "'cmd_vel_timeout' is 0"), 1U) << rig.said();
}

TEST(OmniWheelDrive, ReferencesAreThree) {
  OmniRig rig;
  EXPECT_THAT(rig.manager->controllers()[0].references,
              ElementsAre("linear/x/velocity", "linear/y/velocity", "angular/z/velocity"));
}

std::string refusal_of(const std::string& parameters) {
  BaseRig rig(kOmni, parameters, base_hardware({"a", "b", "c"}));
  return input_error_of([&] { rig.start(); });
}

TEST(OmniWheelDrive, MissingParameterIsRefused) {
  EXPECT_THAT(refusal_of("wheel_names: [a, b]"), HasSubstr("'wheel_names' has 2 joints"));
  EXPECT_THAT(refusal_of("wheel_names: [a, b, b]"), HasSubstr("'wheel_names' lists a joint twice"));
  EXPECT_THAT(refusal_of("wheel_names: [a, b, c]"), HasSubstr("'wheel_offset' is not set"));
  EXPECT_THAT(refusal_of("wheel_names: [a, b, c], wheel_offset: 0.0"),
              HasSubstr("'robot_radius' is not set"));
  EXPECT_THAT(refusal_of("wheel_names: [a, b, c], wheel_offset: 0.0, robot_radius: 0.5, wheel_radius: -0.1"),
              HasSubstr("'wheel_radius'"));
}

}  // namespace
}  // namespace doppel
