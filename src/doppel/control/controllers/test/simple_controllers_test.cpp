// The broadcaster, the forwarding controllers and the PID controller, each under the controller manager.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {
namespace {

using control_msgs::msg::MultiDOFCommand;
using std_msgs::msg::Float64MultiArray;
using testing::ElementsAre;
using testing::HasSubstr;
using Names = std::vector<std::string>;

FakeHardwareOptions offering(Names commands, Names states = {kPosition, kVelocity}) {
  FakeHardwareOptions options;
  options.joints = {"a", "b"};
  options.commands = std::move(commands);
  options.states = std::move(states);
  return options;
}

TEST(JointStateBroadcaster, AllJointsArePublishedInHardwareOrder) {
  FakeHardwareOptions options = offering({kPosition});
  options.joints = {"b", "a"};
  options.state_only_joints = {"finger"};
  options.more_states = {{"gripper force", "newton", 4.5}};
  ManagerRig rig(controller_yaml("c", "joint_state_broadcaster/JointStateBroadcaster", "frame_id: world"),
                 {{"a"}, {"b"}, {.name = "finger", .mimics = "a"}}, options);
  Recorder<sensor_msgs::msg::JointState> states(rig.bus, "/joint_states");
  Recorder<control_msgs::msg::DynamicJointState> dynamic(rig.bus, "/dynamic_joint_states");
  rig.start({"c"});
  rig.hardware->set_position("a", 0.25);
  rig.hardware->set_velocity("finger", -2);
  rig.now = Time(std::chrono::milliseconds(1500));
  rig.run(1);
  rig.bus.spin();
  ASSERT_EQ(states.messages.size(), 1u);
  const auto& m = states.messages[0];
  EXPECT_THAT(m.name, ElementsAre("b", "a", "finger"));
  EXPECT_THAT(m.position, ElementsAre(0, 0.25, 0));
  EXPECT_THAT(m.velocity, ElementsAre(0, 0, -2));
  ASSERT_EQ(m.effort.size(), 3u);
  EXPECT_TRUE(std::isnan(m.effort[0]));
  EXPECT_EQ(m.header.stamp.sec, 1);
  EXPECT_EQ(m.header.stamp.nanosec, 500'000'000u);
  EXPECT_EQ(m.header.frame_id, "world");
  ASSERT_EQ(dynamic.messages.size(), 1u);
  EXPECT_THAT(dynamic.messages[0].joint_names, ElementsAre("b", "a", "finger", "gripper force"));
  EXPECT_THAT(dynamic.messages[0].interface_values[1].interface_names, ElementsAre("position", "velocity"));
  EXPECT_THAT(dynamic.messages[0].interface_values[1].values, ElementsAre(0.25, 0));
  EXPECT_THAT(dynamic.messages[0].interface_values[3].values, ElementsAre(4.5));
}

TEST(JointStateBroadcaster, ParametersSelectMapAndAddJoints) {
  ManagerRig rig(
      controller_yaml("c", "joint_state_broadcaster/JointStateBroadcaster",
                      "joints: [b], interfaces: [velocity], extra_joints: [ghost], use_local_topics: true, "
                      "map_interface_to_joint_state: {position: velocity, velocity: none}"));
  Recorder<sensor_msgs::msg::JointState> states(rig.bus, "/c/joint_states");
  rig.start({"c"});
  rig.hardware->set_velocity("b", 3);
  rig.run(1);
  rig.bus.spin();
  ASSERT_EQ(states.messages.size(), 1u);
  EXPECT_THAT(states.messages[0].name, ElementsAre("b", "ghost"));
  EXPECT_THAT(states.messages[0].position, ElementsAre(3, 0));
  EXPECT_TRUE(std::isnan(states.messages[0].velocity[0]));
}

TEST(JointStateBroadcaster, UnknownJointsAreReported) {
  ManagerRig rig(controller_yaml("c", "joint_state_broadcaster/JointStateBroadcaster",
                                 "joints: [bb], interfaces: [position]"));
  EXPECT_THAT(input_error_of([&] { rig.start({"c"}); }), HasSubstr("did you mean 'b'?"));
  ManagerRig half(controller_yaml("c", "joint_state_broadcaster/JointStateBroadcaster", "joints: [b]"));
  half.start({"c"});
  EXPECT_EQ(half.count(Severity::warning, "every state is published"), 1u) << half.said();
}

TEST(ForwardCommand, CommandsAreForwardedAndHeld) {
  ManagerRig rig(controller_yaml("c", "forward_command_controller/ForwardCommandController",
                                 "joints: [b, a], interface_name: position"));
  rig.start({"c"});
  rig.run(2);
  EXPECT_TRUE(std::isnan(rig.manager->command("a/position")));  // nothing was commanded yet
  rig.say<Float64MultiArray>("/c/commands", {{}, {1.5, -0.5}});
  rig.run(2);
  EXPECT_EQ(rig.hardware->position("b"), 1.5);
  EXPECT_EQ(rig.hardware->position("a"), -0.5);
  EXPECT_EQ(rig.manager->command("b/position"), 1.5);

  for (int i = 0; i < 5; ++i) rig.say<Float64MultiArray>("/c/commands", {{}, {1.0}});
  rig.say<Float64MultiArray>("/c/commands", {{}, {std::nan(""), 0.0}});
  rig.run(1);
  EXPECT_EQ(rig.hardware->position("b"), 1.5);
  EXPECT_EQ(
      rig.count(Severity::error, "a command has 1 value, but there are 2: b/position, a/position; rejected"),
      1u)
      << rig.said();
  EXPECT_EQ(rig.lines.size(), 1u) << rig.said();
  rig.say<Float64MultiArray>("/c/commands", {{}, {0.0, 0.0}});
  rig.say<Float64MultiArray>("/c/commands", {{}, {std::nan(""), 1.0}});
  EXPECT_EQ(rig.count(Severity::error, "not a finite number"), 1u) << rig.said();
}

TEST(ForwardCommand, ActivationClearsCommands) {
  ManagerRig rig(controller_yaml("c", "position_controllers/JointGroupPositionController", "joints: [a]"));
  rig.start({"c"});
  rig.say<Float64MultiArray>("/c/commands", {{}, {1.0}});
  rig.run(1);
  ASSERT_TRUE(rig.switch_to({}, {"c"}).ok());
  rig.say<Float64MultiArray>("/c/commands", {{}, {2.0}});
  ASSERT_TRUE(rig.switch_to({"c"}).ok());
  rig.hardware->set_position("a", 0.125);
  rig.run(3);
  EXPECT_EQ(rig.hardware->position("a"), 0.125);
}

TEST(ForwardCommand, MultipleInterfacesOfOneJointAreForwarded) {
  ManagerRig rig(controller_yaml("c", "forward_command_controller/MultiInterfaceForwardCommandController",
                                 "joint: b, interface_names: [effort, position]"),
                 {{"a"}, {"b"}}, offering({kPosition, kEffort}));
  rig.start({"c"});
  EXPECT_THAT(rig.manager->controllers()[0].claimed, ElementsAre("b/effort", "b/position"));
  rig.say<Float64MultiArray>("/c/commands", {{}, {2.0, 0.5}});
  rig.run(1);
  EXPECT_EQ(rig.hardware->last_command("b/effort"), 2.0);
  EXPECT_EQ(rig.hardware->last_command("b/position"), 0.5);
}

TEST(ForwardCommand, MimicJointValueIsIgnored) {
  ManagerRig rig(
      controller_yaml("c", "position_controllers/JointGroupPositionController", "joints: [a, finger, b]"),
      {{"a"}, {.name = "finger", .mimics = "a"}, {"b"}});
  rig.start({"c"});
  rig.say<Float64MultiArray>("/c/commands", {{}, {1.0, 2.0, 3.0}});
  rig.run(1);
  EXPECT_EQ(rig.hardware->position("a"), 1.0);
  EXPECT_EQ(rig.hardware->position("b"), 3.0);
}

TEST(JointGroupControllers, VelocityAndEffortStopWhenDeactivated) {
  for (const char* interface : {kVelocity, kEffort, kPosition}) {
    const std::string kind = interface;
    const std::string Kind = kind == kVelocity ? "Velocity" : kind == kEffort ? "Effort" : "Position";
    ManagerRig rig(
        controller_yaml("c", kind + "_controllers/JointGroup" + Kind + "Controller", "joints: [a]"),
        {{"a"}, {"b"}}, offering({interface}));
    rig.start({"c"});
    rig.say<Float64MultiArray>("/c/commands", {{}, {0.5}});
    rig.run(1);
    EXPECT_EQ(rig.hardware->last_command("a/" + kind), 0.5);
    ASSERT_TRUE(rig.switch_to({}, {"c"}).ok());
    rig.run(1);
    EXPECT_EQ(rig.hardware->last_command("a/" + kind), kind == kPosition ? 0.5 : 0.0);
  }
}

TEST(JointGroupControllers, VelocityEndsAfterCommandTimeout) {
  FakeHardwareOptions options;
  options.joints = {"a", "b"};
  options.commands = {kVelocity};
  ManagerRig rig(controller_yaml("c", "velocity_controllers/JointGroupVelocityController",
                                 "joints: [a], command_timeout: 0.2"),
                 {{"a"}, {"b"}}, options);
  rig.start({"c"});
  rig.say<Float64MultiArray>("/c/commands", {{}, {0.5}});
  rig.run(20);
  EXPECT_EQ(rig.hardware->last_command("a/velocity"), 0.5);
  rig.run(20);
  EXPECT_EQ(rig.hardware->last_command("a/velocity"), 0.0);
  EXPECT_EQ(rig.count(Severity::warning, "no command for 0.2 s"), 1u) << rig.said();
  rig.say<Float64MultiArray>("/c/commands", {{}, {0.5}});
  rig.run(1);
  EXPECT_EQ(rig.hardware->last_command("a/velocity"), 0.5);
}

TEST(JointGroupControllers, InterfaceParameterIsRefused) {
  ManagerRig rig(controller_yaml("c", "velocity_controllers/JointGroupVelocityController",
                                 "joints: [a], interface_name: effort"));
  EXPECT_THAT(input_error_of([&] { rig.start({"c"}); }), HasSubstr("this type commands 'velocity'"));
}

constexpr const char* kPid =
    "dof_names: [a, b], command_interface: effort, reference_and_state_interfaces: [position, velocity], "
    "gains: {a: {p: 10.0, d: 2.0}, b: {p: 1.0, feedforward_gain: 3.0, angle_wraparound: true, u_clamp_max: "
    "4.0, "
    "u_clamp_min: -4.0}}";

TEST(PidControllerTest, OutputFollowsReferenceAndState) {
  ManagerRig rig(controller_yaml("c", "pid_controller/PidController", kPid), {{"a"}, {"b"}},
                 offering({kEffort}));
  rig.start({"c"});
  Recorder<control_msgs::msg::MultiDOFStateStamped> states(rig.bus, "/c/controller_state");
  rig.run(1);
  EXPECT_TRUE(std::isnan(rig.manager->command("a/effort")));  // no reference, no effort
  rig.hardware->set_position("a", 0.5);
  rig.hardware->set_velocity("a", 0.25);
  rig.say<MultiDOFCommand>("/c/reference", {{"b", "a"}, {3.0, 1.0}, {}});
  rig.hardware->set_position("b", -3.0);
  rig.run(1);
  rig.bus.spin();
  EXPECT_NEAR(rig.manager->command("a/effort"), 10.0 * 0.5 - 2.0 * 0.25, 1e-12);
  EXPECT_NEAR(rig.manager->command("b/effort"), 6.0 - 2 * M_PI, 1e-12);  // the shorter way
  const auto& state = states.messages.back().dof_states;
  ASSERT_EQ(state.size(), 2u);
  EXPECT_EQ(state[0].name, "a");
  EXPECT_NEAR(state[0].error, 0.5, 1e-12);
  EXPECT_NEAR(state[0].error_dot, -0.25, 1e-12);
  EXPECT_NEAR(state[0].output, 4.5, 1e-12);
  EXPECT_NEAR(state[0].time_step, 0.01, 1e-12);

  ASSERT_TRUE(rig.switch_to({}, {"c"}).ok());
  rig.run(1);
  EXPECT_EQ(rig.hardware->last_command("a/effort"), 0.0);
}

TEST(PidControllerTest, GainsAndFeedForwardChangeWhileRunning) {
  ManagerRig rig(controller_yaml("c", "pid_controller/PidController", kPid), {{"a"}, {"b"}},
                 offering({kEffort}));
  rig.start({"c"});
  const auto edge = rig.bus.attach("test");
  rig.say<MultiDOFCommand>("/c/reference", {{}, {1.0, 1.0}, {}});
  Status set = Status::refused("never answered");
  edge->set_parameter("/c", "gains.a.p", ParameterValue(20.0), [&](const Status& status) { set = status; });
  edge->set_parameter("/c", "enable_feedforward", ParameterValue(true), [](const Status&) {});
  rig.run(1);
  EXPECT_TRUE(set.ok()) << set.why();
  EXPECT_NEAR(rig.manager->command("a/effort"), 20.0, 1e-12);
  EXPECT_NEAR(rig.manager->command("b/effort"), 1.0 + 3.0 * 1.0, 1e-12);
}

TEST(PidControllerTest, BadReferencesAndParametersAreRefused) {
  ManagerRig rig(controller_yaml("c", "pid_controller/PidController", kPid), {{"a"}, {"b"}},
                 offering({kEffort}));
  rig.start({"c"});
  rig.say<MultiDOFCommand>("/c/reference", {{"aa"}, {1.0}, {}});
  EXPECT_EQ(rig.count(Severity::error, "did you mean 'a'?"), 1u) << rig.said();
  rig.say<MultiDOFCommand>("/c/reference", {{"a"}, {0.0}, {}});
  rig.say<MultiDOFCommand>("/c/reference", {{"a"}, {1.0, 2.0}, {}});
  EXPECT_EQ(rig.count(Severity::error, "2 values for 1 names"), 1u) << rig.said();
  ManagerRig none(controller_yaml("c", "pid_controller/PidController", "command_interface: effort"));
  EXPECT_THAT(input_error_of([&] { none.start({"c"}); }), HasSubstr("'dof_names' is empty"));
}

}  // namespace
}  // namespace doppel
