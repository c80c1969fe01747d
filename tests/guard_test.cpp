// The guard of real and emulated arms: motions into the arm itself or into a keep-out box are refused before
// anything is sent.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>

#include "twin_fixture.h"

namespace doppel {
namespace {

using test::TwinFixture;
using testing::HasSubstr;
using testing::Not;

// A forearm that folds back into the base.
constexpr const char* kFoldingArm = R"(<robot name="folding_arm"><link name="world"/>
<link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0"
 iyz="0"/></inertial><collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.1 0.2"/></geometry>
</collision></link>
<link name="upper"><inertial><origin xyz="0 0 0.1"/><mass value="0.05"/><inertia ixx="1e-4" iyy="1e-4"
 izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="0 0 0.1"/><geometry>
<box size="0.03 0.03 0.14"/></geometry></collision></link>
<link name="forearm"><inertial><origin xyz="0 0 0.1"/><mass value="0.03"/><inertia ixx="1e-4" iyy="1e-4"
 izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="0 0 0.17"/><geometry>
<box size="0.03 0.03 0.3"/></geometry></collision></link>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/></joint>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.2"/>
<axis xyz="0 1 0"/><limit lower="-1.9" upper="1.9" effort="1.9" velocity="4"/><dynamics damping="0.05"
 friction="0.02"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="forearm"/><origin xyz="0 0 0.2"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1.9" velocity="4"/><dynamics damping="0.05"
 friction="0.02"/></joint>
<ros2_control name="Arm" type="system"><hardware><plugin>doppel/FeetechSts</plugin><param
 name="gentle">never</param></hardware>
<joint name="shoulder"><param name="id">1</param><param name="offset_deg">0</param><command_interface
 name="position"/><state_interface name="position"/><state_interface name="velocity"/></joint>
<joint name="elbow"><param name="id">2</param><param name="offset_deg">0</param><command_interface
 name="position"/><state_interface name="position"/><state_interface name="velocity"/></joint>
</ros2_control></robot>)";

constexpr const char* kForward = R"(controller_manager:
  ros__parameters:
    update_rate: 100
    joint_state_broadcaster: {type: joint_state_broadcaster/JointStateBroadcaster}
    forward: {type: forward_command_controller/ForwardCommandController}
forward:
  ros__parameters: {joints: [shoulder, elbow], interface_name: position}
)";

class Guard : public TwinFixture {
 protected:
  Guard() {
    log_.add_sink([this](const LogLine& line) { logged_ += line.text + "\n"; });
  }
  void bring_up_arm(bool guard = true, const std::string& world = "", const std::string& controllers = "") {
    const std::filesystem::path folder = make_folder("guard");
    std::string text = kFoldingArm;
    for (std::size_t i = 0; (i = text.find("elbow", i)) != std::string::npos; i += elbow_.size())
      text.replace(i, 5, elbow_);
    std::ofstream(folder / "arm.urdf") << text;
    Scenario scenario;
    scenario.robots = {{.target = (folder / "arm.urdf").string()}};
    scenario.hardware = HardwareUse::emulated;
    scenario.guard = guard;
    scenario.mirror = mirror_;
    if (!world.empty()) {
      std::ofstream(folder / "desk.yaml") << world;
      scenario.world = folder / "desk.yaml";
    }
    if (!controllers.empty()) {
      std::ofstream(folder / "controllers.yaml") << controllers;
      scenario.robots[0].controllers = {(folder / "controllers.yaml").string()};
    }
    bring_up(scenario);
    run(1.5);
  }
  void send(double shoulder, double elbow) {
    publish("/joint_trajectory_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
            fmt::format("{{joint_names: [shoulder, {}], points: [{{positions: [{}, {}], time_from_start: "
                        "{{sec: 2}}}}]}}",
                        elbow_, shoulder, elbow));
    run(2.5);
  }
  std::string logged_, elbow_ = "elbow";
  MirrorMode mirror_ = MirrorMode::shadow;
};

TEST_F(Guard, PathIntoOwnBaseIsRefusedWithPairAndTime) {
  bring_up_arm();
  const double before = joint("elbow").q;
  send(0, 2.95);
  EXPECT_THAT(logged_, HasSubstr("'forearm' would touch 'base' at 1."));
  EXPECT_NEAR(joint("elbow").q, before, 0.01) << "nothing is sent";
  send(0.3, 1.2);
  EXPECT_NEAR(joint("elbow").q, 1.2, 0.05) << "another path goes on";
}

TEST_F(Guard, WithoutGuardPathIsFollowed) {
  bring_up_arm(false);
  send(0, 2.95);
  EXPECT_THAT(logged_, Not(HasSubstr("would touch")));
  EXPECT_GT(joint("elbow").q, 2.0);
}

TEST_F(Guard, PathIntoKeepOutBoxIsRefusedByItsName) {
  bring_up_arm(true, "keep_out:\n  - {name: monitor, box: [0.1, 1, 1], xyz: [0.3, 0, 0.5]}\n");
  send(0, 1.4);
  EXPECT_THAT(logged_, HasSubstr("'forearm' would enter the keep-out box 'monitor' at "));
  EXPECT_NEAR(joint("elbow").q, 0, 0.05);
}

// In simulated time a rehearsal takes none, so that a run is repeatable.
TEST_F(Guard, EmulatedArmRehearsesAndRepeatsItself) {
  mirror_ = MirrorMode::rehearse;
  std::vector<std::uint64_t> hashes;
  for (int i = 0; i < 2; ++i) {
    logged_.clear();
    bring_up_arm(true, "objects:\n  - {name: shelf, box: [0.1, 1, 1], xyz: [0.3, 0, 0.5]}\n");
    send(0, 1.4);
    EXPECT_THAT(logged_, HasSubstr("in the rehearsal 'forearm' would touch 'shelf' at "));
    EXPECT_NEAR(joint("elbow").target, 0, 0.01) << "nothing is sent";
    send(0.2, -0.6);
    EXPECT_NEAR(joint("elbow").q, -0.6, 0.05) << logged_;
    hashes.push_back(twin_->state_hash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST_F(Guard, OnlyFingersMayTouchWhatMovesInRehearsal) {
  const std::string ball =
      "gravity: [0, 0, 0]\nobjects:\n  - {name: ball, sphere: {radius: 0.03}, xyz: [0.3, 0, 0.5], mass: "
      "0.01}\n";
  mirror_ = MirrorMode::rehearse;
  bring_up_arm(true, ball);
  send(0, 1.4);
  EXPECT_THAT(logged_, HasSubstr("in the rehearsal 'forearm' would touch 'ball' at "));
  EXPECT_LT(joint("elbow").q, 0.1);
  logged_.clear();
  elbow_ = "jaw";
  bring_up_arm(true, ball);
  send(0, 1.4);
  EXPECT_THAT(logged_, Not(HasSubstr("in the rehearsal")));
  EXPECT_NEAR(joint("jaw").q, 1.4, 0.05);
}

TEST_F(Guard, RehearsalWithoutGuardRefusesAsWell) {
  mirror_ = MirrorMode::rehearse;
  bring_up_arm(false);
  send(0, 2.95);
  EXPECT_THAT(logged_, HasSubstr("in the rehearsal 'forearm' would touch 'base' at 1."));
  EXPECT_LT(joint("elbow").q, 0.1);
}

TEST_F(Guard, StreamedCommandIsHeldAtLastPermittedOne) {
  bring_up_arm(true, "", kForward);
  publish("/forward/commands", "std_msgs/msg/Float64MultiArray", "{data: [0, 2.95]}");
  run(3.0);
  EXPECT_THAT(logged_, HasSubstr("'forearm' would touch 'base': the joints hold"));
  EXPECT_GT(joint("elbow").q, 2.0);
  EXPECT_LT(joint("elbow").q, 2.9);
  publish("/forward/commands", "std_msgs/msg/Float64MultiArray", "{data: [0, 1.0]}");
  run(2.0);
  EXPECT_NEAR(joint("elbow").q, 1.0, 0.05);
}

}  // namespace
}  // namespace doppel
