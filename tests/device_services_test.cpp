// A person works at the devices of a running robot: the torque off for a hand, and on again; a pose that
// servos without encoders cannot know.
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "doppel/ros/messages/doppel_msgs.h"
#include "twin_fixture.h"

namespace doppel {
namespace {

using doppel_msgs::msg::Devices;
using testing::HasSubstr;

constexpr const char* kServoArm = R"(<robot name="desk_arm"><link name="world"/>
<link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0"
 iyz="0"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.05 0 0"/><mass value="0.1"/><inertia ixx="5e-5" iyy="1e-4"
 izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 0.3"/></joint>
<joint name="lift" type="revolute"><parent link="base"/><child link="fore"/><axis xyz="0 -1 0"/>
<limit lower="-1.9" upper="1.9" effort="1.9" velocity="5"/><dynamics damping="0.05"
 friction="0.02"/></joint>
<ros2_control name="Arm" type="system"><hardware><plugin>PLUGIN</plugin><param
 name="gentle">never</param></hardware>
<joint name="lift"><param name="id">1</param><param name="offset_deg">0</param><command_interface
 name="position"/><state_interface name="position"/><state_interface name="velocity"/></joint>
</ros2_control></robot>)";

class DeviceServices : public test::TwinFixture {
 protected:
  void bring_up_arm(const char* plugin, HandMotion hand) {
    folder_ = make_folder("device_services");
    ::setenv("XDG_STATE_HOME", folder_.c_str(), 1);
    description_ = kServoArm;
    description_.replace(description_.find("PLUGIN"), 6, plugin);
    std::ofstream(folder_ / "arm.urdf") << description_;
    Scenario scenario;
    scenario.robots = {{.target = (folder_ / "arm.urdf").string()}};
    scenario.hardware = HardwareUse::emulated;
    scenario.emulation.hand = hand;
    bring_up(scenario);
    run(1.5);
    listen("/doppel/hardware");
  }
  // attribute: an edit of the description, name="value".
  void reload_with(const std::string& attribute) {
    const std::string name = attribute.substr(0, attribute.find('"') + 1);
    std::string text = description_;
    const std::size_t begin = text.rfind(name), value = begin + name.size();
    text.replace(begin, text.find('"', value) + 1 - begin, attribute);
    std::ofstream(folder_ / "arm.urdf") << text;
    Diagnostics findings;
    EXPECT_EQ(twin_->replace(Twin::prepare(twin_->running(), findings)), Twin::Reload::controllers_kept);
  }
  std::string press(const std::string& service) {
    return call("/doppel/hardware/" + service, "std_srvs/srv/Trigger", "{}");
  }
  std::string guide(double position) {
    return call("/doppel/hardware/guide", "doppel_msgs/srv/GuideJoint",
                "{joint: lift, position: " + std::to_string(position) + "}");
  }
  std::string confirm(const std::string& position) {
    return call("/doppel/hardware/confirm_pose", "doppel_msgs/srv/ConfirmPose",
                "{component: Arm, joints: [lift], positions: [" + position + "]}");
  }
  std::string release_joint(double duration) {
    return call(
        "/doppel/hardware/release_joint", "doppel_msgs/srv/ReleaseJoint",
        "{joint: lift, duration: " + std::to_string(duration) + ", lower: -1.5, upper: 0.5, speed: 4.5}");
  }
  std::string state() {
    run(0.2);
    const auto all = received<Devices>("/doppel/hardware");
    return all.empty() ? "" : std::string(all.back().devices.at(0).state);
  }
  [[nodiscard]] bool commands() const {
    for (const ControllerView& one : twin_->robot().controller_manager().controllers()) {
      if (!one.claimed.empty()) return true;
    }
    return false;
  }

  std::filesystem::path folder_;
  std::string description_;
};

TEST_F(DeviceServices, ReleasedArmFallsAndHoldsAgainWithItsControllers) {
  bring_up_arm("doppel/FeetechSts", HandMotion::none);
  EXPECT_EQ(state(), "active");
  ASSERT_TRUE(commands());
  EXPECT_THAT(press("release"), HasSubstr("success: true"));
  EXPECT_EQ(state(), "connected");
  EXPECT_FALSE(commands());
  run(1.5);
  EXPECT_LT(joint("lift").q, -0.5) << "nothing holds it";
  const double fallen = joint("lift").q;
  EXPECT_THAT(press("hold"), HasSubstr("success: true"));
  run(1.5);
  EXPECT_TRUE(commands());
  EXPECT_NEAR(joint("lift").q, fallen, 0.1) << "it holds where it is";
  EXPECT_THAT(press("hold"), HasSubstr("no device is inactive"));
}

// The trajectory controller holds on, and the arm falls from under it until its time is over.
TEST_F(DeviceServices, JointIsReleasedForShortTimeUnderItsController) {
  bring_up_arm("doppel/FeetechSts", HandMotion::none);
  EXPECT_THAT(release_joint(2.5), HasSubstr("may be at most 2 s"));
  ASSERT_THAT(release_joint(0.15), HasSubstr("success: true"));
  run(0.6);
  const double fallen = joint("lift").q;
  EXPECT_LT(fallen, -0.05) << "damping and friction let it fall slowly";
  EXPECT_GT(fallen, -1.5);
  ASSERT_TRUE(commands());
  run(1.0);
  EXPECT_NEAR(joint("lift").q, fallen, 0.02) << "the controller still commands where it was lifted to";
  const auto reports = received<Devices>("/doppel/hardware");
  const auto& last = reports.back().devices.at(0).joints.at(0);
  EXPECT_NEAR(to_seconds(from_msg(last.torque_on)) - to_seconds(from_msg(last.torque_off)), 0.15, 0.015);
  EXPECT_NEAR(last.goal, fallen, 0.05);
  EXPECT_TRUE(std::ranges::any_of(reports, [](const Devices& one) {
    return static_cast<bool>(one.devices.at(0).joints.at(0).released);
  }));
}

TEST_F(DeviceServices, StopDuringReleaseCatchesJoint) {
  bring_up_arm("doppel/FeetechSts", HandMotion::none);
  ASSERT_THAT(release_joint(2.0), HasSubstr("success: true"));
  run(0.1);
  twin_->robot().controller_manager().stop("test");
  const double caught = joint("lift").q;
  run(1.0);
  EXPECT_NEAR(joint("lift").q, caught, 0.15);
  EXPECT_THAT(release_joint(1.0), HasSubstr("the emergency stop is active"));
}

TEST_F(DeviceServices, HandMovesReleasedJointAndServoMeasuresIt) {
  bring_up_arm("doppel/FeetechSts", HandMotion::guide);
  ASSERT_THAT(press("release"), HasSubstr("success: true"));
  run(0.3);
  EXPECT_NEAR(joint("lift").q, 0, 0.05) << "the hand holds it";
  EXPECT_THAT(guide(1.2), HasSubstr("success: true"));
  run(2.0);
  EXPECT_NEAR(joint("lift").q, 1.2, 0.05);
  EXPECT_NEAR(twin_->robot().controller_manager().state("lift/position"), joint("lift").q, 0.01);
}

TEST_F(DeviceServices, HandIsFollowedFromReleaseOnAndTwiceToSamePlace) {
  bring_up_arm("doppel/FeetechSts", HandMotion::guide);
  EXPECT_THAT(guide(0.8), HasSubstr("success: true"));
  run(0.5);
  EXPECT_NEAR(joint("lift").q, 0, 0.1) << "the torque is on";
  ASSERT_THAT(press("release"), HasSubstr("success: true"));
  run(0.5);
  EXPECT_NEAR(joint("lift").q, 0, 0.1) << "the hand has not moved since";
  ASSERT_THAT(press("hold"), HasSubstr("success: true"));
  ASSERT_THAT(press("release"), HasSubstr("success: true"));
  EXPECT_THAT(guide(0.8), HasSubstr("success: true"));
  run(1.5);
  EXPECT_NEAR(joint("lift").q, 0.8, 0.1);
}

TEST_F(DeviceServices, ReloadLeavesHandAndTorqueAtJoint) {
  bring_up_arm("doppel/FeetechSts", HandMotion::guide);
  reload_with("mass value=\"0.11\"");
  run(1.0);
  EXPECT_NEAR(joint("lift").q, 0, 0.1) << "the torque is on";
  ASSERT_THAT(press("release"), HasSubstr("success: true"));
  EXPECT_THAT(guide(1.2), HasSubstr("success: true"));
  run(0.05);
  reload_with("mass value=\"0.12\"");
  run(1.5);
  EXPECT_NEAR(joint("lift").q, 1.2, 0.1) << "the hand continues";
  EXPECT_THAT(guide(0.4), HasSubstr("success: true"));
  run(1.5);
  EXPECT_NEAR(joint("lift").q, 0.4, 0.1);
  EXPECT_THAT(press("hold"), HasSubstr("success: true"));
}

TEST_F(DeviceServices, ReloadGivesMotorsTheirEditedEffort) {
  bring_up_arm("doppel/FeetechSts", HandMotion::none);
  reload_with("effort=\"0.01\"");
  run(1.5);
  EXPECT_LT(joint("lift").q, -0.5) << "it is too weak to hold the arm";
}

TEST_F(DeviceServices, StoppedArmIsNotReleased) {
  bring_up_arm("doppel/FeetechSts", HandMotion::none);
  twin_->robot().controller_manager().stop("the test");
  EXPECT_THAT(press("release"), HasSubstr("emergency stop"));
  EXPECT_EQ(state(), "active");
}

// The controllers start as they do where the pose is known.
TEST_F(DeviceServices, StartWaitsForPoseAndThenControllersHoldArm) {
  bring_up_arm("doppel/ServoLine", HandMotion::none);
  EXPECT_EQ(state(), "unconfirmed");
  EXPECT_FALSE(commands());
  EXPECT_THAT(press("hold"), HasSubstr("confirm the pose"));
  EXPECT_THAT(confirm("2.5"), HasSubstr("outside of the limits"));
  EXPECT_THAT(confirm(".nan"), HasSubstr("success: false"));
  EXPECT_EQ(state(), "unconfirmed");
  EXPECT_THAT(confirm("0.3"), HasSubstr("success: true"));
  EXPECT_EQ(state(), "active");
  EXPECT_TRUE(commands());
  run(1.0);  // until the servo is there
  EXPECT_NEAR(joint("lift").q, 0.3, 0.05);
  EXPECT_THAT(press("release"), HasSubstr("report no positions"));
  EXPECT_TRUE(commands());
}

TEST_F(DeviceServices, MeasuredPoseNeedsNoConfirmation) {
  bring_up_arm("doppel/FeetechSts", HandMotion::none);
  ASSERT_THAT(press("release"), HasSubstr("success: true"));
  EXPECT_THAT(confirm("0.3"), HasSubstr("it measures its positions"));
}

}  // namespace
}  // namespace doppel
