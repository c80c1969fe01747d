// Controllers of each distribution of ROS 2, as a process on Cyclone DDS with the types of the twin receives
// them. Services of Cyclone in ROS 2 do not work with those of Fast DDS, so that the goal is sent by the
// client of doppel.

#include <control_msgs.h>
#include <gtest/gtest.h>

#include "cyclone_peer.h"
#include "published_hashes.h"
#include "twin_process.h"

namespace doppel::ros2_testing {
namespace {

using FeedbackMessage = control_msgs_action_dds__FollowJointTrajectory_FeedbackMessage_;
using Status = control_msgs_msg_dds__SteeringControllerStatus_;

// -1: the type of this distribution has no index.
template <class Feedback>
int index_of(const Feedback& feedback) {
  if constexpr (requires { feedback.index_; }) return feedback.index_;
  return -1;
}
template <class Message>
std::uint32_t traction_of(const Message& status) {
  if constexpr (requires { status.traction_command_; }) return status.traction_command_._length;
  if constexpr (requires { status.linear_velocity_command_; }) return status.linear_velocity_command_._length;
}

TEST(CycloneControl, FeedbackIsReadToItsEndAndNamesPoint) {
  TwinProcess twin;
  CyclonePeer peer(own_domain());
  auto feedback = peer.subscribe(CYCLONE_TYPE(control_msgs, action, FollowJointTrajectory_FeedbackMessage),
                                 "rt/omarm_arm_controller/follow_joint_trajectory/_action/feedback");
  // Sent again until this peer is known to the twin: feedback is volatile.
  const std::string goal =
      "{trajectory: {joint_names: [Revolute 1, Revolute 2, Revolute 3, Revolute 4, Revolute 5, Revolute 6], "
      "points: "
      "[{positions: [0.1, 0, 0, 0, 0, 0], time_from_start: {sec: 1}}, "
      "{positions: [0.2, 0, 0, 0, 0, 0], time_from_start: {sec: 2}}]}}";
  std::unique_ptr<Process> client;
  const auto send_again = [&] {
    if (client != nullptr && client->running()) return;
    client =
        std::make_unique<Process>(std::vector<std::string>{doppel_program(), "action", "send_goal",
                                                           "/omarm_arm_controller/follow_joint_trajectory",
                                                           "control_msgs/action/FollowJointTrajectory", goal},
                                  twin.variables(), twin.folder() / "client");
  };
  const int last = twin_distro() == "jazzy" ? -1 : 1;
  EXPECT_TRUE(eventually([&] {
    send_again();
    return feedback.take([&](const FeedbackMessage& message) {
      const auto& about = message.feedback_;
      return about.joint_names_._length == 6 && about.error_.positions_._length == 6 &&
             about.multi_dof_joint_names_._length == 0 && index_of(about) == last;
    });
  })) << twin.output();
}

TEST(CycloneControl, SteeringStatusIsRead) {
  TwinProcess car({}, "ackermann_car");
  CyclonePeer peer(own_domain());
  auto status = peer.subscribe(CYCLONE_TYPE(control_msgs, msg, SteeringControllerStatus),
                               "rt/base_controller/controller_state");
  EXPECT_TRUE(status.next([](const Status& message) {
    return message.steer_positions_._length == 2 && message.steering_angle_command_._length == 2 &&
           traction_of(message) == 2;
  })) << car.output();
}

}  // namespace
}  // namespace doppel::ros2_testing
