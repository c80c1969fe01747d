// The differences between the distributions of ROS 2 in controllers and their manager: types, parameters,
// defaults.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "doppel/control/controllers/test/base_rig.h"
#include "doppel/control/manager/distro_differences.h"
#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/controller_manager_msgs.h"

namespace doppel {
namespace {

using testing::HasSubstr;

constexpr const char* kFollower = "joint_trajectory_controller/JointTrajectoryController";
constexpr const char* kPositionGroup = "position_controllers/JointGroupPositionController";
constexpr const char* kAllStates = "joint_state_broadcaster/JointStateBroadcaster";

class ControllersOfDistro : public testing::TestWithParam<Distro> {
 protected:
  ControllersOfDistro() { set_ros_distro(GetParam()); }
  ~ControllersOfDistro() override { set_ros_distro(Distro::jazzy); }

  static std::string trajectory_yaml(const std::string& more) {
    return controller_yaml(
        "c", kFollower,
        "joints: [a, b], command_interfaces: [position], state_interfaces: [position], " + more);
  }
  static bool is(Distro distro) { return GetParam() == distro; }
};

TEST_P(ControllersOfDistro, TypeThatIsNotInDistroIsReported) {
  ManagerRig rig(controller_yaml("c", kPositionGroup, "joints: [a, b]"));
  rig.start({"c"});
  EXPECT_EQ(rig.count(Severity::warning, "is not in ROS 2 Lyrical"), is(Distro::lyrical) ? 1U : 0U)
      << rig.said();
}

TEST_P(ControllersOfDistro, ParameterThatIsNotInDistroIsIgnoredAndReportedOnce) {
  ManagerRig rig(trajectory_yaml("open_loop_control: true"));
  rig.start({"c"});
  EXPECT_EQ(rig.count(Severity::warning, "'open_loop_control' is deprecated"), is(Distro::jazzy) ? 1U : 0U);
  EXPECT_EQ(rig.count(Severity::warning, "'open_loop_control' is not a parameter of"),
            is(Distro::jazzy) ? 0U : 1U)
      << rig.said();
  EXPECT_EQ(rig.count(Severity::warning, "open_loop_control"), 1U) << rig.said();
}

TEST_P(ControllersOfDistro, ValueThatIsNotInDistroIsRefused) {
  ManagerRig rig(trajectory_yaml("gains: {a: {antiwindup_strategy: legacy}}"));
  const std::string error = input_error_of([&] { rig.start({"c"}); });
  if (is(Distro::jazzy)) {
    EXPECT_EQ(error, "");
  } else {
    EXPECT_THAT(error, HasSubstr("'gains.a.antiwindup_strategy' is 'legacy', which ROS 2"));
  }
}

TEST_P(ControllersOfDistro, DynamicJointStatesArePublishedByDefaultOfDistro) {
  ManagerRig rig(controller_yaml("c", kAllStates, "frame_id: base"));
  Recorder<control_msgs::msg::DynamicJointState> recorder(rig.bus, "/dynamic_joint_states");
  rig.start({"c"});
  rig.run(3);
  EXPECT_EQ(recorder.messages.empty(), is(Distro::lyrical));
}

TEST_P(ControllersOfDistro, DynamicJointStatesAreOffOnDemand) {
  ManagerRig rig(controller_yaml("c", kAllStates, "publish_dynamic_joint_states: false"));
  Recorder<control_msgs::msg::DynamicJointState> recorder(rig.bus, "/dynamic_joint_states");
  rig.start({"c"});
  rig.run(3);
  EXPECT_TRUE(recorder.messages.empty());
}

// Without a strictness in the request; one of the two controllers does not exist.
TEST_P(ControllersOfDistro, SwitchIsAsStrictAsDefaultOfDistro) {
  ManagerRig rig(controller_yaml("c", kPositionGroup, "joints: [a, b]"));
  rig.start({"c"});
  controller_manager_msgs::srv::SwitchController::Request request;
  request.deactivate_controllers = {"c", "no_such"};
  const auto response = rig.call<controller_manager_msgs::srv::SwitchController>(
      "/controller_manager/switch_controller", request);
  EXPECT_EQ(response.ok, !is(Distro::lyrical)) << response.message;
}

TEST_P(ControllersOfDistro, FramesOfSteeringHavePrefixSinceLyrical) {
  BaseRig rig("ackermann_steering_controller/AckermannSteeringController",
              "traction_joints_names: [r, l], steering_joints_names: [rs, ls], wheelbase: 2.0, "
              "traction_track_width: 1.0, traction_wheels_radius: 0.5, tf_frame_prefix: left",
              base_hardware({"r", "l"}, {"rs", "ls"}));
  rig.start();
  rig.drive(1.0, 0, 0, 0.1);
  ASSERT_FALSE(rig.odometry.empty());
  EXPECT_EQ(rig.odometry[0].header.frame_id, is(Distro::lyrical) ? "left/odom" : "odom");
  EXPECT_EQ(rig.odometry[0].child_frame_id, is(Distro::lyrical) ? "left/base_link" : "base_link");
  EXPECT_EQ(rig.count(Severity::warning, "'tf_frame_prefix' is not a parameter of"),
            is(Distro::lyrical) ? 0U : 1U)
      << rig.said();
}

TEST_P(ControllersOfDistro, FeedForwardHasServiceInJazzy) {
  ManagerRig rig(controller_yaml("c", "pid_controller/PidController",
                                 "dof_names: [a], command_interface: position, "
                                 "reference_and_state_interfaces: [position], gains: {a: {p: 1.0}}"));
  rig.start({"c"});
  const auto services = rig.bus.services();
  EXPECT_EQ(std::ranges::count(services, "/c/set_feedforward_control", &ServiceInfo::name),
            is(Distro::jazzy) ? 1 : 0)
      << rig.said();
}

INSTANTIATE_TEST_SUITE_P(All, ControllersOfDistro,
                         testing::Values(Distro::jazzy, Distro::kilted, Distro::lyrical),
                         [](const auto& each) { return std::string(to_string(each.param)); });

// A misspelled row would never apply.
TEST(DistroDifferences, EveryBuiltinTypeOfRos2IsListed) {
  for (const std::string& type : builtin_controllers().names()) {
    EXPECT_TRUE(type.starts_with("doppel/") || find_ros2_type(type) != nullptr) << type;
  }
}

}  // namespace
}  // namespace doppel
