#include "doppel/devices/drivers/servo_assignment.h"

#include <gmock/gmock.h>

#include <cmath>

#include "doppel/description/urdf/load.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::Pair;

constexpr const char* kRobot =
    R"(<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="turn" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-6" upper="6" effort="150" velocity="3"/></joint>
<joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
<limit lower="0" upper="0.04" effort="20" velocity="0.1"/></joint>
<joint name="wheel" type="continuous"><parent link="c"/><child link="d"/><axis xyz="0 0 1"/>
<limit effort="5" velocity="10"/></joint>
<ros2_control name="Sim" type="system"><hardware><plugin>gz_ros2_control/GazeboSimSystem</plugin>
<param name="x">1</param></hardware>
<joint name="turn"><command_interface name="position"/><command_interface name="effort"/></joint>
<joint name="slide"><command_interface name="position"/></joint>
<joint name="wheel"><command_interface name="velocity"/></joint>
<joint name="gone"><command_interface name="position"/></joint></ros2_control></robot>)";

class ServoAssignmentTest : public testing::Test {
 protected:
  ServoAssignmentTest()
      : robot_(parse_urdf(kRobot, "r.urdf", packages_, diagnostics_)),
        model_(compile_model(robot_, BaseKind::fixed, diagnostics_)) {}
  PackageResolver packages_;
  Diagnostics diagnostics_;
  RobotDescription robot_;
  Model model_;
};

TEST_F(ServoAssignmentTest, TravelOfServoCoversLimitsOfJoint) {
  HardwareDescription hardware = robot_.hardware.front();
  ASSERT_TRUE(assign_servos(hardware, model_, ServoProtocol::feetech));
  EXPECT_EQ(hardware.plugin, "doppel/FeetechSts");
  const ServoSetup setup = read_servo_setup(hardware, model_, diagnostics_);
  ASSERT_EQ(setup.joints.size(), 2u) << "a wheel has no position command";
  EXPECT_EQ(setup.joints[0].id, 1);
  EXPECT_EQ(setup.joints[0].velocity, 3) << "of the description";
  EXPECT_EQ(setup.joints[1].id, 2);
  for (const JointServo& one : setup.joints) {
    EXPECT_LE(std::abs(one.shaft(one.lower)), 3.01) << one.joint;
    EXPECT_NEAR(std::abs(one.shaft(one.upper)), 3.0, 0.01) << one.joint;
  }
}

TEST_F(ServoAssignmentTest, JointWithoutSpeedLimitTurnsAtServosSpeed) {
  HardwareDescription hardware = robot_.hardware.front();
  for (ModelJoint& joint : model_.joints) joint.velocity = joint.name == "turn" ? 0 : INFINITY;
  ASSERT_TRUE(assign_servos(hardware, model_, ServoProtocol::dynamixel));
  const ServoSetup setup = read_servo_setup(hardware, model_, diagnostics_);
  EXPECT_NEAR(setup.joints[0].velocity, 8, 1e-9) << "4 rad/s of the shaft, half as much for each radian";
  EXPECT_NEAR(setup.joints[1].velocity, 4.0 / 75, 1e-9);
}

TEST_F(ServoAssignmentTest, ChannelsOfBoardBeginWithZero) {
  HardwareDescription hardware = robot_.hardware.front();
  ASSERT_TRUE(assign_servos(hardware, model_, ServoProtocol::servo_line));
  EXPECT_EQ(read_servo_setup(hardware, model_, diagnostics_).joints[0].id, 0);
  EXPECT_THAT(hardware.params, ElementsAre(Pair("gentle", "never"), Pair("confirm_pose", "false")));
}

TEST_F(ServoAssignmentTest, ServosOfDescriptionStay) {
  HardwareDescription hardware = robot_.hardware.front();
  hardware.plugin = "doppel/DynamixelX";
  const auto params = hardware.params;
  EXPECT_TRUE(assign_servos(hardware, model_, ServoProtocol::feetech));
  EXPECT_EQ(hardware.plugin, "doppel/DynamixelX");
  EXPECT_EQ(hardware.params, params);
}

TEST_F(ServoAssignmentTest, HardwareWithoutPositionCommandGetsNone) {
  HardwareDescription hardware = robot_.hardware.front();
  std::erase_if(hardware.joints, [](const HardwareJointDescription& one) { return one.name != "wheel"; });
  EXPECT_FALSE(assign_servos(hardware, model_, ServoProtocol::feetech));
  EXPECT_EQ(hardware.plugin, "gz_ros2_control/GazeboSimSystem");
}

}  // namespace
}  // namespace doppel
