// The drivers of real servos in a twin, on emulated buses whose motors are the simulated joints.
#include <gmock/gmock.h>

#include <fstream>
#include <optional>

#include "twin_fixture.h"

namespace doppel {
namespace {

using test::TwinFixture;

constexpr double kTick = 2 * 3.14159265358979 / 4096;

constexpr const char* kArm = R"(<robot name="desk_arm"><link name="world"/>
<link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0"
 iyz="0"/></inertial></link>
<link name="upper"><inertial><origin xyz="0 0 0.05"/><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4"
 izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.05 0 0"/><mass value="0.1"/><inertia ixx="5e-5" iyy="1e-4"
 izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 0.2"/></joint>
<joint name="pan" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-1.9" upper="1.9" effort="1.9" velocity="5"/><dynamics damping="0.05"
 friction="0.02"/></joint>
<joint name="lift" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0
 0.1"/><axis xyz="0 -1 0"/>
<limit lower="-1.9" upper="1.9" effort="1.9" velocity="5"/><dynamics damping="0.05"
 friction="0.02"/></joint>
<ros2_control name="Arm" type="system"><hardware><plugin>PLUGIN</plugin><param
 name="gentle">never</param></hardware>
<joint name="pan"><param name="id">1</param><param name="offset_deg">0</param><command_interface
 name="position"/><state_interface name="position"/><state_interface name="velocity"/></joint>
<joint name="lift"><param name="id">2</param><param name="offset_deg">0</param><command_interface
 name="position"/><state_interface name="position"/><state_interface name="velocity"/></joint>
</ros2_control></robot>)";

class EmulatedHardware : public TwinFixture, public testing::WithParamInterface<const char*> {
 protected:
  void bring_up_arm(HardwareUse use) {
    std::string text = kArm;
    text.replace(text.find("PLUGIN"), 6, GetParam());
    const std::filesystem::path file = make_folder("emulated_arm") / "arm.urdf";
    std::ofstream(file) << text;
    Scenario scenario;
    scenario.robots = {{.target = file.string()}};
    scenario.hardware = use;
    bring_up(scenario);
  }
  void follow_trajectory() {
    run(1.5);  // the torque's ramp
    publish("/joint_trajectory_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
            "{joint_names: [pan, lift], points: [{positions: [0.9, -0.6], time_from_start: {sec: 1}}]}");
    run(2.5);
  }
  double position(const char* joint) {
    const Instance arm = twin_->robot().instance();
    return arm.q()[static_cast<std::size_t>(
        arm.model().joints[static_cast<std::size_t>(arm.model().find_joint(joint))].q)];
  }
};

// A description for a simulator, whose drives are far stronger than a small servo.
class EmulatedHardwareOfAnyRobot : public TwinFixture {
 protected:
  void bring_up_arm(std::optional<ServoProtocol> servos) {
    std::string text = kArm;
    text.replace(text.find("PLUGIN"), 6, "gz_ros2_control/GazeboSimSystem");
    for (const char* joint : {"pan", "lift"}) {
      const std::size_t effort = text.find("effort=\"1.9\"", text.find(joint));
      text.replace(effort, 12, "effort=\"150\"");
    }
    const std::size_t mass = text.rfind("<mass value=\"0.1\"/>");
    text.replace(mass, 19, "<mass value=\"20\"/>");
    const std::filesystem::path file = make_folder("emulated_any") / "arm.urdf";
    std::ofstream(file) << text;
    Scenario scenario;
    scenario.robots = {{.target = file.string()}};
    scenario.hardware = HardwareUse::emulated;
    scenario.emulation.servos = servos;
    bring_up(scenario);
  }
};

TEST_P(EmulatedHardware, TrajectoryEndsWhereSimulatedOneEnds) {
  bring_up_arm(HardwareUse::simulated);
  follow_trajectory();
  const double pan = position("pan"), lift = position("lift");
  bring_up_arm(HardwareUse::emulated);
  follow_trajectory();
  EXPECT_NEAR(position("pan"), pan, 2 * kTick);
  EXPECT_NEAR(position("lift"), lift, 2 * kTick);
  EXPECT_NEAR(position("pan"), 0.9, 0.02);
}

TEST_P(EmulatedHardware, SameRunGivesSameHash) {
  bring_up_arm(HardwareUse::emulated);
  follow_trajectory();
  const std::uint64_t first = twin_->state_hash();
  bring_up_arm(HardwareUse::emulated);
  follow_trajectory();
  EXPECT_EQ(twin_->state_hash(), first);
}

TEST_P(EmulatedHardware, WithoutDriversArmIsWithoutTorque) {
  bring_up_arm(HardwareUse::ports);
  run(2.0);
  EXPECT_LT(position("lift"), -0.5) << "it falls until a host turns the torque on";
}

TEST_F(EmulatedHardwareOfAnyRobot, EveryJointGetsServoAndMotionEndsWhereSimulatedOneDoes) {
  for (const ServoProtocol protocol :
       {ServoProtocol::feetech, ServoProtocol::dynamixel, ServoProtocol::servo_line}) {
    SCOPED_TRACE(to_string(protocol));
    bring_up_arm(protocol);
    run(1.5);
    publish("/joint_trajectory_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
            "{joint_names: [pan, lift], points: [{positions: [0.9, -0.6], time_from_start: {sec: 1}}]}");
    run(2.5);
    const Instance arm = twin_->robot().instance();
    EXPECT_NEAR(arm.q()[0], 0.9, 0.03);
    EXPECT_NEAR(arm.q()[1], -0.6, 0.03);
    DeviceReport report;
    ASSERT_TRUE(twin_->robot().controller_manager().report(0, report));
    ASSERT_EQ(report.joints.size(), 2u);
    EXPECT_EQ(report.joints[1].id, protocol == ServoProtocol::servo_line ? 1 : 2);
  }
}

TEST_F(EmulatedHardwareOfAnyRobot, WithoutProtocolRefusesRobotWithoutServos) {
  try {
    bring_up_arm(std::nullopt);
    FAIL() << "it is an ordinary simulation";
  } catch (const InputError& refused) {
    EXPECT_THAT(refused.what(), testing::HasSubstr("'Arm' has gz_ros2_control/GazeboSimSystem"));
    EXPECT_THAT(refused.what(), testing::HasSubstr("--protocol feetech"));
  }
}

INSTANTIATE_TEST_SUITE_P(Plugins, EmulatedHardware, testing::Values("doppel/FeetechSts", "doppel/DynamixelX"),
                         [](const auto& one) { return std::string(one.param).substr(7); });

}  // namespace
}  // namespace doppel
