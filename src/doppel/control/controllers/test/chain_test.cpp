// Chains: one controller commands the reference interfaces of another in the same tick.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Names = std::vector<std::string>;

// forward -> pid -> a/effort; loaded in this order, so that the order of loading is not the order of the
// chain.
constexpr const char* kChain = R"(controller_manager:
  ros__parameters:
    pid: {type: pid_controller/PidController}
    forward: {type: forward_command_controller/ForwardCommandController}
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
pid: {ros__parameters: {dof_names: [a], command_interface: effort, reference_and_state_interfaces: [position],
                        gains: {a: {p: 2.0, i: 0.0, d: 0.0}}}}
forward: {ros__parameters: {joints: [pid/a], interface_name: position}}
arm: {ros__parameters: {joints: [a], command_joints: [pid/a], command_interfaces: [position],
                        state_interfaces: [position]}}
)";

struct ChainRig : ManagerRig {
  ChainRig() : ManagerRig(kChain, {{"a"}}, effort_driven()) {
    for (const char* name : {"pid", "forward", "arm"}) {
      manager->load(name);
      if (const Status status = manager->configure(name); !status) throw std::logic_error(status.why());
    }
  }
  static FakeHardwareOptions effort_driven() {
    FakeHardwareOptions options;
    options.joints = {"a"};
    options.commands = {kEffort};
    return options;
  }
  void command(double value) { say<std_msgs::msg::Float64MultiArray>("/forward/commands", {{}, {value}}); }
  [[nodiscard]] ControllerView view(const std::string& name) const {
    for (const ControllerView& v : manager->controllers()) {
      if (v.name == name) return v;
    }
    throw std::logic_error("no controller " + name);
  }
};

TEST(ControllerChain, ReferenceIsFollowedInSameTick) {
  ChainRig rig;
  ASSERT_TRUE(rig.switch_to({"forward", "pid"}).ok());
  EXPECT_TRUE(rig.view("pid").chained);
  EXPECT_THAT(rig.view("pid").references, ElementsAre("a/position"));
  rig.command(0.5);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 2.0 * 0.5);
  EXPECT_EQ(rig.manager->reference("a/position"), 0.5);
}

TEST(ControllerChain, TrajectoryControllerLeadsPidController) {
  ChainRig rig;
  rig.hardware->set_position("a", 0.1);
  ASSERT_TRUE(rig.switch_to({"arm", "pid"}).ok());
  trajectory_msgs::msg::JointTrajectory message;
  message.joint_names = {"a"};
  message.points.resize(1);
  message.points[0].positions = {0.6};
  message.points[0].time_from_start = to_duration_msg(from_seconds(0.1));
  rig.say("/arm/joint_trajectory", message);
  rig.run(15);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 2.0 * (0.6 - 0.1));
}

TEST(ControllerChain, TopicIsIgnoredInChainedMode) {
  ChainRig rig;
  ASSERT_TRUE(rig.switch_to({"forward", "pid"}).ok());
  rig.command(0.5);
  rig.run(1);
  rig.say<control_msgs::msg::MultiDOFCommand>("/pid/reference", {{}, {3.0}, {}});
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 1.0);
  ASSERT_TRUE(rig.switch_to({}, {"forward"}).ok());
  EXPECT_FALSE(rig.view("pid").chained);
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 0.0);  // it stays where it is
  rig.say<control_msgs::msg::MultiDOFCommand>("/pid/reference", {{}, {3.0}, {}});
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.hardware->last_command("a/effort"), 6.0);
}

TEST(ControllerChain, LeaderWithoutFollowerIsRefused) {
  ChainRig rig;
  EXPECT_THAT(rig.switch_to({"forward"}).why(),
              HasSubstr("'forward' commands 'pid/a/position', a reference interface of 'pid', which is not "
                        "active"));
  ASSERT_TRUE(rig.switch_to({"pid"}).ok());
  EXPECT_FALSE(rig.view("pid").chained);
  ASSERT_TRUE(rig.switch_to({"forward"}).ok());
  EXPECT_TRUE(rig.view("pid").chained);
}

TEST(ControllerChain, StoppingFollowerOfActiveLeaderIsRefused) {
  ChainRig rig;
  ASSERT_TRUE(rig.switch_to({"forward", "pid"}).ok());
  EXPECT_THAT(rig.switch_to({}, {"pid"}).why(),
              HasSubstr("cannot deactivate 'pid', because 'forward' commands its reference interfaces"));
  EXPECT_EQ(rig.state_of("pid"), ControllerState::active);
  ASSERT_TRUE(rig.switch_to({}, {"pid", "forward"}).ok());
  EXPECT_EQ(rig.state_of("pid"), ControllerState::inactive);
}

TEST(ControllerChain, SecondLeaderIsRefused) {
  ChainRig rig;
  ASSERT_TRUE(rig.switch_to({"forward", "pid"}).ok());
  EXPECT_THAT(
      rig.switch_to({"arm"}).why(),
      HasSubstr("'arm' claims the command interface 'pid/a/position', which is claimed by 'forward'"));
  ASSERT_TRUE(rig.switch_to({"arm"}, {"forward"}).ok());
  EXPECT_TRUE(rig.view("pid").chained);
}

TEST(ControllerChain, HardwareFailureStopsChain) {
  ChainRig rig;
  ASSERT_TRUE(rig.switch_to({"forward", "pid"}).ok());
  rig.hardware->read_answer = HardwareReturn::error;
  rig.run(1);
  EXPECT_EQ(rig.state_of("pid"), ControllerState::inactive);
  EXPECT_EQ(rig.state_of("forward"), ControllerState::inactive);
}

TEST(ControllerChain, EmergencyStopResetRestartsChain) {
  ChainRig rig;
  ASSERT_TRUE(rig.switch_to({"forward", "pid"}).ok());
  rig.manager->stop("the test");
  EXPECT_EQ(rig.state_of("forward"), ControllerState::inactive);
  ASSERT_TRUE(rig.manager->reset_stop().ok());
  EXPECT_EQ(rig.state_of("forward"), ControllerState::active);
  EXPECT_TRUE(rig.view("pid").chained);
}

TEST(ControllerChain, LeaderNamedFirstStartsChain) {
  const std::string yaml = R"(controller_manager:
  ros__parameters:
    forward: {type: forward_command_controller/ForwardCommandController}
    pid: {type: pid_controller/PidController}
forward: {ros__parameters: {joints: [pid/a], interface_name: position}}
pid: {ros__parameters: {dof_names: [a], command_interface: effort, reference_and_state_interfaces: [position]}}
)";
  ManagerRig named(yaml, {{"a"}}, ChainRig::effort_driven());
  named.start({"forward", "pid"});
  EXPECT_EQ(named.state_of("forward"), ControllerState::active);
  ManagerRig found(yaml, {{"a"}}, ChainRig::effort_driven());
  found.manager->start_compatible(Names{"forward", "pid"});
  EXPECT_EQ(found.state_of("forward"), ControllerState::active) << found.said();
}

TEST(ControllerChain, ListControllersReportsChain) {
  ChainRig rig;
  ASSERT_TRUE(rig.switch_to({"forward", "pid"}).ok());
  using controller_manager_msgs::srv::ListControllers;
  const auto listed = rig.call<ListControllers>("/controller_manager/list_controllers", {});
  rig.run(1);
  ASSERT_EQ(listed.controller.size(), 3u);
  EXPECT_TRUE(listed.controller[0].is_chainable);
  EXPECT_TRUE(listed.controller[0].is_chained);
  EXPECT_THAT(listed.controller[0].reference_interfaces, ElementsAre("a/position"));
  EXPECT_FALSE(listed.controller[1].is_chainable);
  ASSERT_EQ(listed.controller[1].chain_connections.size(), 1u);
  EXPECT_EQ(listed.controller[1].chain_connections[0].name, "pid");
  EXPECT_THAT(listed.controller[1].chain_connections[0].reference_interfaces, ElementsAre("a/position"));
  EXPECT_THAT(listed.controller[0].chain_connections, IsEmpty());
}

TEST(ControllerChain, UnloadedFollowerWithdrawsReferences) {
  ChainRig rig;
  EXPECT_TRUE(rig.manager->unload("pid").ok());
  EXPECT_THAT(rig.switch_to({"forward"}).why(), HasSubstr("which no hardware exports"));
  rig.manager->load("pid");
  ASSERT_TRUE(rig.manager->configure("pid").ok());
  EXPECT_TRUE(rig.switch_to({"forward", "pid"}).ok());
}

}  // namespace
}  // namespace doppel
