// What joint_trajectory_controller reports, ~/controller_state and ~/query_state, and the speed scaling that
// it applies.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/test/jtc_rig.h"

namespace doppel {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Names = std::vector<std::string>;
using State = control_msgs::msg::JointTrajectoryControllerState;
using Query = control_msgs::srv::QueryTrajectoryState;
using control_msgs::msg::SpeedScalingFactor;

// jtc.md, B66.
TEST(JtcReports, VectorsFollowInterfaces) {
  const std::vector<std::pair<Names, Names>> combinations = {
      {{kPosition}, {kPosition}},
      {{kPosition}, {kPosition, kVelocity}},
      {{kPosition, kVelocity, kAcceleration}, {kPosition, kVelocity, kAcceleration}},
      {{kVelocity}, {kPosition, kVelocity}},
      {{kPosition, kEffort}, {kPosition, kVelocity}}};
  for (const auto& [commands, states] : combinations) {
    JtcRig rig(options_of(commands, states));
    Recorder<State> received(rig.bus, "/arm/controller_state");
    rig.run(5);
    ASSERT_THAT(received.messages, SizeIs(5)) << "expected one message for each update";
    const State& now = received.messages.back();
    const auto has = [](const Names& names, const char* name) {
      return std::find(names.begin(), names.end(), name) == names.end() ? 0u : 3u;
    };
    EXPECT_EQ(now.joint_names, kJoints);
    EXPECT_THAT(now.reference.positions, SizeIs(3));
    EXPECT_THAT(now.reference.velocities, SizeIs(3));
    EXPECT_THAT(now.reference.accelerations, SizeIs(3));
    for (const auto* one : {&now.feedback, &now.error}) {
      EXPECT_THAT(one->positions, SizeIs(3));
      EXPECT_THAT(one->velocities, SizeIs(has(states, kVelocity)));
      EXPECT_THAT(one->accelerations, SizeIs(has(states, kAcceleration)));
    }
    EXPECT_THAT(now.output.positions, SizeIs(has(commands, kPosition)));
    EXPECT_THAT(now.output.velocities, SizeIs(has(commands, kVelocity)));
    EXPECT_THAT(now.output.accelerations, SizeIs(has(commands, kAcceleration)));
    EXPECT_THAT(now.output.effort, SizeIs(has(commands, kEffort)));
    EXPECT_DOUBLE_EQ(now.speed_scaling_factor, 1);
  }
}

// jtc.md, B66.
TEST(JtcReports, JointsWithoutCommandHaveNanOutput) {
  JtcRig rig(options_of({kPosition}, {kPosition}, "command_joints: [c, a]"));
  Recorder<State> received(rig.bus, "/arm/controller_state");
  rig.run(1);
  const auto& output = received.messages.back().output.positions;
  ASSERT_THAT(output, SizeIs(3));
  EXPECT_DOUBLE_EQ(output[0], 0);
  EXPECT_TRUE(std::isnan(output[1]));
}

// jtc.md, B67.
TEST(JtcReports, TimeFromStartIsReported) {
  JtcRig rig;
  Recorder<State> received(rig.bus, "/arm/controller_state");
  rig.say("/arm/speed_scaling_input", SpeedScalingFactor{0.5});
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run(21);
  EXPECT_EQ(from_msg(received.messages.back().reference.time_from_start),
            from_seconds(0.1));  // of the trajectory
  EXPECT_EQ(from_msg(received.messages.back().feedback.time_from_start), from_seconds(0.2));  // of the clock
  EXPECT_DOUBLE_EQ(received.messages.back().speed_scaling_factor, 0.5);
}

// jtc.md, B68.
TEST(JtcReports, OutputNeedsFiniteCommands) {
  JtcOptions options = options_of({kVelocity}, {kPosition, kVelocity});
  options.start = false;
  JtcRig rig(options);
  rig.hardware->set_velocity("a", std::nan(""));  // so that its loop has no messages
  rig.start();
  Recorder<State> received(rig.bus, "/arm/controller_state");
  rig.run(1);
  EXPECT_THAT(received.messages.back().output.velocities, IsEmpty());
  EXPECT_DOUBLE_EQ(rig.command("b/velocity"), 0);
  rig.hardware->set_velocity("a", 0);
  rig.run(1);
  EXPECT_THAT(received.messages.back().output.velocities, ElementsAre(0, 0, 0));
}

Query::Response query(JtcRig& rig, double time) {
  Query::Request request;
  request.time = to_time_msg(time_from_seconds(time));
  Query::Response out;
  rig.call_service<Query>("/arm/query_state", request,
                          [&](const Query::Response& response) { out = response; });
  return out;
}

// jtc.md, B69.
TEST(JtcReports, QueryStateAnswersDuringTrajectoryOnly) {
  JtcRig rig;
  const double start = rig.time();
  rig.say(trajectory(kJoints, {point(1, {1, 2, 3})}));
  rig.run(2);
  const Query::Response inside = query(rig, start + 0.5);
  EXPECT_TRUE(inside.success) << inside.message;
  EXPECT_EQ(inside.name, kJoints);
  EXPECT_NEAR(inside.position[1], 1, 1e-9);
  EXPECT_NEAR(inside.velocity[1], 2, 1e-9);
  EXPECT_THAT(inside.acceleration, ElementsAre(0, 0, 0));
  EXPECT_FALSE(query(rig, start - 0.5).success);
  EXPECT_THAT(query(rig, start - 0.5).message, HasSubstr("before the start"));
  EXPECT_FALSE(query(rig, start + 1).success);
  EXPECT_THAT(query(rig, start + 3).message,
              AllOf(HasSubstr("at or after the end"), HasSubstr("query an earlier time")));
  ASSERT_TRUE(rig.deactivate().ok());
  EXPECT_FALSE(query(rig, start + 0.5).success);
  EXPECT_THAT(query(rig, start + 0.5).message, HasSubstr("not active"));
  EXPECT_EQ(rig.count(Severity::warning, "query_state"), 6u);
}

// jtc.md, B70.
TEST(JtcReports, TimeAdvancesByScalingFactor) {
  JtcRig rig;
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(0.2);
  rig.say("/arm/speed_scaling_input", SpeedScalingFactor{0.0});
  rig.run(1);
  const double stopped = rig.command("a/position");
  rig.run_for(1);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), stopped);
  rig.say("/arm/speed_scaling_input", SpeedScalingFactor{-1});
  rig.say("/arm/speed_scaling_input", SpeedScalingFactor{std::nan("")});
  rig.run_for(0.2);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), stopped);
  EXPECT_EQ(rig.count(Severity::warning, "is ignored"), 2u);
  rig.say("/arm/speed_scaling_input", SpeedScalingFactor{2});
  rig.run_for(0.41);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
}

// jtc.md, B70.
TEST(JtcReports, InitialFactorAppliesToPositionOnly) {
  JtcRig slow(options_of({kPosition}, {kPosition}, "speed_scaling: {initial_scaling_factor: 0.5}"));
  slow.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  slow.run_for(1);
  EXPECT_NEAR(slow.command("a/position"), 0.5, 0.02);
  JtcRig other(
      options_of({kPosition, kVelocity}, {kPosition}, "speed_scaling: {initial_scaling_factor: 0.5}"));
  EXPECT_EQ(other.count(Severity::warning, "initial scaling factor has no effect"), 1u);
  other.say("/arm/speed_scaling_input", SpeedScalingFactor{0});
  other.say(trajectory(kJoints, {point(1, {1, 1, 1}, {0, 0, 0})}));
  other.run_for(1.1);
  EXPECT_DOUBLE_EQ(other.command("a/position"), 1);
}

JtcOptions scaled_hardware(std::string more) {
  JtcOptions options = options_of({kPosition}, {kPosition}, "speed_scaling: {" + more + "}");
  options.more_states = {{"speed_scaling", "factor", 0.5}};
  options.more_commands = {{"speed_scaling", "wanted", std::nan("")}};
  return options;
}

// jtc.md, B72.
TEST(JtcReports, HardwareFactorOverridesTopic) {
  JtcRig rig(scaled_hardware("state_interface: speed_scaling/factor"));
  Recorder<State> received(rig.bus, "/arm/controller_state");
  rig.say("/arm/speed_scaling_input", SpeedScalingFactor{2});
  rig.run(1);
  EXPECT_DOUBLE_EQ(received.messages.back().speed_scaling_factor, 0.5);
  EXPECT_EQ(rig.count(Severity::warning, "will overwrite the speed scaling factor"), 1u);
}

// jtc.md, B72.
TEST(JtcReports, FactorIsWrittenToHardware) {
  JtcRig rig(scaled_hardware("command_interface: speed_scaling/wanted"));
  EXPECT_DOUBLE_EQ(rig.command("speed_scaling/wanted"), 1);
  rig.say("/arm/speed_scaling_input", SpeedScalingFactor{0.3});
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.command("speed_scaling/wanted"), 0.3);
}

// jtc.md, B72.
TEST(JtcReports, InvalidFactorKeepsLast) {
  JtcOptions options = scaled_hardware("state_interface: speed_scaling/factor");
  options.more_states[0].initial = std::nan("");
  JtcRig rig(options);
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(1.1);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
  EXPECT_GE(rig.count(Severity::warning, "'speed_scaling/factor' is not a usable speed scaling factor"), 1u);
}

// jtc.md, B73.
TEST(JtcReports, WrongScalingInterfaceFailsActivation) {
  for (const char* wrong :
       {"state_interface: speed_scaling/fator", "command_interface: speed_scaling/wantd"}) {
    JtcOptions options = scaled_hardware(wrong);
    options.start = false;
    JtcRig rig(options);
    rig.manager->load("arm");
    ASSERT_TRUE(rig.manager->configure("arm").ok());
    EXPECT_THAT(rig.activate().why(), HasSubstr("speed_scaling/"));
    EXPECT_EQ(rig.state_of("arm"), ControllerState::inactive);
  }
}

}  // namespace
}  // namespace doppel
