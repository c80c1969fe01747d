// FollowJointTrajectory as an action client on Fast DDS drives it: to success, preemption, cancel and abort.

#include <action_msgs.h>
#include <control_msgs.h>
#include <gtest/gtest.h>

#include <random>

#include "fast_twin_test.h"

namespace doppel::ros2_testing {
namespace {

using namespace control_msgs::action::dds_;  // NOLINT
using action_msgs::msg::dds_::GoalStatusArray_;
using action_msgs::srv::dds_::CancelGoal_Request_;
using action_msgs::srv::dds_::CancelGoal_Response_;
using Goal = FollowJointTrajectory_Goal_;
using Result = FollowJointTrajectory_GetResult_Response_;
using Uuid = std::array<std::uint8_t, 16>;

// action_msgs/msg/GoalStatus
constexpr int kExecuting = 2, kSucceeded = 4, kCanceled = 5, kAborted = 6;
// control_msgs/action/FollowJointTrajectory_Result
constexpr int kSuccessful = 0, kInvalidGoal = -1, kPathToleranceViolated = -4;

class ActionClient {
 public:
  ActionClient(FastPeer& peer, const std::string& action)
      : send_goal_(peer, action + "/_action/send_goal"),
        get_result_(peer, action + "/_action/get_result"),
        cancel_goal_(peer, action + "/_action/cancel_goal"),
        feedback_(
            peer.subscribe<FollowJointTrajectory_FeedbackMessage_>("rt" + action + "/_action/feedback")),
        status_(peer.subscribe<GoalStatusArray_>("rt" + action + "/_action/status", {.latched = true})) {}

  // As rclcpp_action: ready when all five are there.
  bool wait_for_server() {
    return send_goal_.wait_for_service() && get_result_.wait_for_service() &&
           cancel_goal_.wait_for_service() &&
           eventually([&] { return feedback_.matched() > 0 && status_.matched() > 0; });
  }
  std::optional<FollowJointTrajectory_SendGoal_Response_> send(const Uuid& id, const Goal& goal) {
    FollowJointTrajectory_SendGoal_Request_ request;
    request.goal_id_().uuid_() = id;
    request.goal_() = goal;
    return send_goal_.call(request);
  }
  std::optional<Result> result(const Uuid& id) {
    FollowJointTrajectory_GetResult_Request_ request;
    request.goal_id_().uuid_() = id;
    return get_result_.call(request);
  }
  std::optional<CancelGoal_Response_> cancel(const Uuid& id) {
    CancelGoal_Request_ request;
    request.goal_info_().goal_id_().uuid_() = id;
    return cancel_goal_.call(request);
  }
  bool feedback_about(const Uuid& id) {
    return feedback_
        .next([&](const auto& message) {
          return message.goal_id_().uuid_() == id && message.feedback_().joint_names_() == arm_joints() &&
                 message.feedback_().actual_().positions_().size() == arm_joints().size();
        })
        .has_value();
  }
  // Waits until the status topic has told this of the goal.
  bool status_becomes(const Uuid& id, int wanted) {
    return status_
        .next([&](const GoalStatusArray_& all) {
          for (const auto& each : all.status_list_())
            if (each.goal_info_().goal_id_().uuid_() == id && each.status_() == wanted) return true;
          return false;
        })
        .has_value();
  }

 private:
  ServiceClient<FollowJointTrajectory_SendGoal_Request_, FollowJointTrajectory_SendGoal_Response_> send_goal_;
  ServiceClient<FollowJointTrajectory_GetResult_Request_, Result> get_result_;
  ServiceClient<CancelGoal_Request_, CancelGoal_Response_> cancel_goal_;
  Subscription<FollowJointTrajectory_FeedbackMessage_> feedback_;
  Subscription<GoalStatusArray_> status_;
};

class FastActions : public FastTwinTest {
 protected:
  void SetUp() override {
    FastTwinTest::SetUp();
    ASSERT_TRUE(arm.wait_for_server()) << "the action's five parts are not all there";
  }
  static Uuid new_id() {
    static std::random_device random;
    Uuid id;
    for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(random());
    return id;
  }
  // All joints to one angle, in so much of simulated time.
  static Goal go_to(double angle, double seconds) {
    Goal goal;
    goal.trajectory_().joint_names_() = arm_joints();
    auto& point = goal.trajectory_().points_().emplace_back();
    point.positions_().assign(arm_joints().size(), angle);
    point.time_from_start_().sec_() = static_cast<std::int32_t>(seconds);
    point.time_from_start_().nanosec_() = static_cast<std::uint32_t>((seconds - std::floor(seconds)) * 1e9);
    return goal;
  }
  void expect_end(const Uuid& id, int status, int error_code, const std::string& error_starts) {
    const auto result = arm.result(id);
    ASSERT_TRUE(result.has_value()) << "no result";
    EXPECT_EQ(result->status_(), status);
    EXPECT_EQ(result->result_().error_code_(), error_code);
    EXPECT_TRUE(result->result_().error_string_().starts_with(error_starts))
        << result->result_().error_string_();
  }
  ActionClient arm{peer, "/omarm_arm_controller/follow_joint_trajectory"};
};

TEST_F(FastActions, Succeeds) {
  const Uuid id = new_id();
  const auto accepted = arm.send(id, go_to(0.1, 0.5));
  ASSERT_TRUE(accepted.has_value());
  EXPECT_TRUE(accepted->accepted_());
  EXPECT_TRUE(arm.status_becomes(id, kExecuting));
  EXPECT_TRUE(arm.feedback_about(id));
  expect_end(id, kSucceeded, kSuccessful, "Goal successfully reached!");
  EXPECT_TRUE(arm.status_becomes(id, kSucceeded));
  expect_end(id, kSucceeded, kSuccessful, "Goal successfully reached!");  // kept for who asks later
}

TEST_F(FastActions, ANewGoalPreemptsTheOld) {
  const Uuid old_one = new_id(), new_one = new_id();
  ASSERT_TRUE(arm.send(old_one, go_to(0.5, 1000)).value().accepted_());
  EXPECT_TRUE(arm.status_becomes(old_one, kExecuting));
  ASSERT_TRUE(arm.send(new_one, go_to(0.1, 0.5)).value().accepted_());
  expect_end(old_one, kAborted, kInvalidGoal, "Current goal preempted by new incoming action.");
  expect_end(new_one, kSucceeded, kSuccessful, "Goal successfully reached!");
}

TEST_F(FastActions, IsCanceled) {
  const Uuid id = new_id();
  ASSERT_TRUE(arm.send(id, go_to(0.5, 1000)).value().accepted_());
  EXPECT_TRUE(arm.status_becomes(id, kExecuting));
  const auto answer = arm.cancel(id);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->return_code_(), 0);  // ERROR_NONE
  ASSERT_EQ(answer->goals_canceling_().size(), 1u);
  EXPECT_EQ(answer->goals_canceling_()[0].goal_id_().uuid_(), id);
  expect_end(id, kCanceled, kSuccessful, "");
  EXPECT_TRUE(arm.status_becomes(id, kCanceled));
  EXPECT_EQ(arm.cancel(id).value().return_code_(), 3);        // ERROR_GOAL_TERMINATED
  EXPECT_EQ(arm.cancel(new_id()).value().return_code_(), 2);  // ERROR_UNKNOWN_GOAL_ID
}

TEST_F(FastActions, IsAbortedOutsideOfItsTolerance) {
  const Uuid id = new_id();
  Goal goal = go_to(1.0, 1);
  auto& tolerance = goal.path_tolerance_().emplace_back();
  tolerance.name_() = "Revolute 1";
  tolerance.position_() = 1e-9;  // no servo follows so closely
  ASSERT_TRUE(arm.send(id, goal).value().accepted_());
  expect_end(id, kAborted, kPathToleranceViolated, "Aborted due to path tolerance violation");
}

TEST_F(FastActions, AGoalForUnknownJointsIsRejected) {
  const Uuid id = new_id();
  Goal goal = go_to(0.1, 0.5);
  goal.trajectory_().joint_names_()[2] = "no joint";
  const auto answer = arm.send(id, goal);
  ASSERT_TRUE(answer.has_value());
  EXPECT_FALSE(answer->accepted_());
  EXPECT_EQ(arm.result(id).value().status_(), 0) << "STATUS_UNKNOWN for a goal that never was";
}

}  // namespace
}  // namespace doppel::ros2_testing
