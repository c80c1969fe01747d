// The differences between the distributions of ROS 2 in controllers and their manager, as a process on Fast
// DDS with the types of the twin's distribution receives it.

#include <control_msgs.h>
#include <controller_manager_msgs.h>
#include <gtest/gtest.h>
#include <type_description_interfaces.h>

#include "fast_action_client.h"
#include "fast_twin_test.h"
#include "published_hashes.h"

namespace doppel::ros2_testing {
namespace {

using namespace controller_manager_msgs::srv::dds_;      // NOLINT
using namespace type_description_interfaces::srv::dds_;  // NOLINT

class FastControl : public FastTwinTest {};

// Has the field that Jazzy alone has.
template <class Component>
std::string class_type_of(const Component& component) {
  if constexpr (requires { component.class_type_(); }) return component.class_type_();
  return "not on the wire";
}

TEST_F(FastControl, HardwareComponentsAreListed) {
  ServiceClient<ListHardwareComponents_Request_, ListHardwareComponents_Response_> list(
      peer, "/controller_manager/list_hardware_components");
  const auto response = list.call({});
  ASSERT_TRUE(response.has_value());
  ASSERT_EQ(response->component_().size(), 1U);
  const auto& component = response->component_()[0];
  EXPECT_EQ(component.name_(), "OmArmHardware");
  EXPECT_EQ(component.type_(), "system");
  EXPECT_EQ(class_type_of(component), twin_distro() == "jazzy" ? "system" : "not on the wire");
  EXPECT_FALSE(component.plugin_name_().empty());
  EXPECT_EQ(component.state_().label_(), "active");
  EXPECT_EQ(component.command_interfaces_().size(), 7U);
}

// The point of the trajectory that is approached.
template <class Feedback>
int index_of(const Feedback& feedback, int otherwise) {
  if constexpr (requires { feedback.index_(); }) return feedback.index_();
  return otherwise;
}

TEST_F(FastControl, FeedbackIsReadToItsEndAndNamesPoint) {
  ActionClient<FollowJointTrajectory> arm{peer, "/omarm_arm_controller/follow_joint_trajectory"};
  ASSERT_TRUE(arm.wait_for_server());
  FollowJointTrajectory::Goal goal;
  goal.trajectory_().joint_names_() = arm_joints();
  for (int i = 1; i <= 3; ++i) {
    auto& point = goal.trajectory_().points_().emplace_back();
    point.positions_().assign(arm_joints().size(), 0.02 * i);
    point.time_from_start_().nanosec_() = static_cast<std::uint32_t>(300'000'000 * i);
  }
  const Uuid id = new_id();
  ASSERT_TRUE(arm.send(id, goal).value().accepted_());
  for (const int index : {0, 1, 2}) {
    EXPECT_TRUE(arm.feedback_about(id, [&](const auto& feedback) {
      return feedback.joint_names_() == arm_joints() &&
             feedback.error_().positions_().size() == arm_joints().size() &&
             feedback.multi_dof_joint_names_().empty() && index_of(feedback, index) == index;
    })) << index;
  }
  EXPECT_EQ(arm.result(id).value().status_(), kSucceeded);
}

// The commands to the driven wheels under the name of the distribution.
template <class Status>
const std::vector<double>& traction_of(const Status& status) {
  if constexpr (requires { status.traction_command_(); }) return status.traction_command_();
  if constexpr (requires { status.linear_velocity_command_(); }) return status.linear_velocity_command_();
}

TEST_F(FastControl, SteeringStatusIsRead) {
  TwinProcess car({"--ros-args", "-r", "__ns:=/car", "-r", "/clock:=clock"}, "ackermann_car");
  auto status = peer.subscribe<control_msgs::msg::dds_::SteeringControllerStatus_>(
      "rt/car/base_controller/controller_state");
  EXPECT_TRUE(status.next([](const auto& message) {
    return message.steer_positions_().size() == 2 && message.steering_angle_command_().size() == 2 &&
           traction_of(message).size() == 2;
  })) << car.output();
}

TEST_F(FastControl, TypeDescriptionIsOfDistro) {
  ServiceClient<GetTypeDescription_Request_, GetTypeDescription_Response_> describe(
      peer, "/omarm_arm_controller/get_type_description");
  GetTypeDescription_Request_ request;
  request.type_name_() = "control_msgs/action/FollowJointTrajectory_Feedback";
  request.type_hash_() = published_hashes().at(request.type_name_());
  const auto response = describe.call(request);
  ASSERT_TRUE(response.has_value());
  ASSERT_TRUE(response->successful_()) << response->failure_reason_();
  const auto& fields = response->type_description_().type_description_().fields_();
  const bool has_index =
      std::any_of(fields.begin(), fields.end(), [](const auto& f) { return f.name_() == "index"; });
  EXPECT_EQ(has_index, twin_distro() != "jazzy");
}

}  // namespace
}  // namespace doppel::ros2_testing
