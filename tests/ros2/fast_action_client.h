#pragma once
// An action client like rclcpp_action's, on Fast DDS with fastddsgen's types: three services, feedback and
// status. A names the action's types, as FollowJointTrajectory below does.

#include <action_msgs.h>
#include <control_msgs.h>

#include <array>
#include <cstdint>
#include <random>

#include "fast_peer.h"

namespace doppel::ros2_testing {

using Uuid = std::array<std::uint8_t, 16>;

// action_msgs/msg/GoalStatus
constexpr int kExecuting = 2, kSucceeded = 4, kCanceled = 5, kAborted = 6;

inline Uuid new_id() {
  static std::random_device random;
  Uuid id;
  for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(random());
  return id;
}

struct FollowJointTrajectory {
  using Goal = control_msgs::action::dds_::FollowJointTrajectory_Goal_;
  using SendGoalRequest = control_msgs::action::dds_::FollowJointTrajectory_SendGoal_Request_;
  using SendGoalResponse = control_msgs::action::dds_::FollowJointTrajectory_SendGoal_Response_;
  using GetResultRequest = control_msgs::action::dds_::FollowJointTrajectory_GetResult_Request_;
  using GetResultResponse = control_msgs::action::dds_::FollowJointTrajectory_GetResult_Response_;
  using FeedbackMessage = control_msgs::action::dds_::FollowJointTrajectory_FeedbackMessage_;
};

template <class A>
class ActionClient {
  using CancelRequest = action_msgs::srv::dds_::CancelGoal_Request_;
  using CancelResponse = action_msgs::srv::dds_::CancelGoal_Response_;
  using Statuses = action_msgs::msg::dds_::GoalStatusArray_;

 public:
  using Result = typename A::GetResultResponse;

  ActionClient(FastPeer& peer, const std::string& action)  // "/arm/follow_joint_trajectory"
      : send_goal_(peer, action + "/_action/send_goal"),
        get_result_(peer, action + "/_action/get_result"),
        cancel_goal_(peer, action + "/_action/cancel_goal"),
        feedback_(peer.subscribe<typename A::FeedbackMessage>("rt" + action + "/_action/feedback")),
        status_(peer.subscribe<Statuses>("rt" + action + "/_action/status", {.latched = true})) {}

  // As in rclcpp_action: ready when all five are matched.
  bool wait_for_server() {
    return send_goal_.wait_for_service() && get_result_.wait_for_service() &&
           cancel_goal_.wait_for_service() &&
           eventually([&] { return feedback_.matched() > 0 && status_.matched() > 0; });
  }
  std::optional<typename A::SendGoalResponse> send(const Uuid& id, const typename A::Goal& goal) {
    typename A::SendGoalRequest request;
    request.goal_id_().uuid_() = id;
    request.goal_() = goal;
    return send_goal_.call(request);
  }
  std::optional<Result> result(const Uuid& id) {
    typename A::GetResultRequest request;
    request.goal_id_().uuid_() = id;
    return get_result_.call(request);
  }
  std::optional<CancelResponse> cancel(const Uuid& id) {
    CancelRequest request;
    request.goal_info_().goal_id_().uuid_() = id;
    return cancel_goal_.call(request);
  }
  // Waits for feedback about the goal for which `wanted` holds.
  template <class Wanted>
  bool feedback_about(const Uuid& id, const Wanted& wanted) {
    return feedback_
        .next([&](const auto& message) {
          return message.goal_id_().uuid_() == id && wanted(message.feedback_());
        })
        .has_value();
  }
  // Waits until the status topic reports this about the goal.
  bool status_becomes(const Uuid& id, int wanted) {
    return status_
        .next([&](const Statuses& all) {
          for (const auto& each : all.status_list_())
            if (each.goal_info_().goal_id_().uuid_() == id && each.status_() == wanted) return true;
          return false;
        })
        .has_value();
  }

 private:
  ServiceClient<typename A::SendGoalRequest, typename A::SendGoalResponse> send_goal_;
  ServiceClient<typename A::GetResultRequest, Result> get_result_;
  ServiceClient<CancelRequest, CancelResponse> cancel_goal_;
  Subscription<typename A::FeedbackMessage> feedback_;
  Subscription<Statuses> status_;
};

}  // namespace doppel::ros2_testing
