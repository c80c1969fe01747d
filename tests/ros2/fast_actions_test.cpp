// FollowJointTrajectory as an action client on Fast DDS uses it: to success, preemption, cancel and abort.

#include <gtest/gtest.h>

#include <cmath>

#include "fast_action_client.h"
#include "fast_twin_test.h"

namespace doppel::ros2_testing {
namespace {

using Goal = FollowJointTrajectory::Goal;

// control_msgs/action/FollowJointTrajectory_Result
constexpr int kSuccessful = 0, kInvalidGoal = -1, kPathToleranceViolated = -4;

class FastActions : public FastTwinTest {
 protected:
  void SetUp() override {
    FastTwinTest::SetUp();
    ASSERT_TRUE(arm.wait_for_server()) << "expected the action's five topics and services";
  }
  // All joints to one angle, in the given simulated time.
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
    ASSERT_TRUE(result.has_value()) << "expected a result";
    EXPECT_EQ(result->status_(), status);
    EXPECT_EQ(result->result_().error_code_(), error_code);
    EXPECT_TRUE(result->result_().error_string_().starts_with(error_starts))
        << result->result_().error_string_();
  }
  ActionClient<FollowJointTrajectory> arm{peer, "/omarm_arm_controller/follow_joint_trajectory"};
};

TEST_F(FastActions, GoalSucceeds) {
  const Uuid id = new_id();
  const auto accepted = arm.send(id, go_to(0.1, 0.5));
  ASSERT_TRUE(accepted.has_value());
  EXPECT_TRUE(accepted->accepted_());
  EXPECT_TRUE(arm.status_becomes(id, kExecuting));
  EXPECT_TRUE(arm.feedback_about(id, [](const auto& feedback) {
    return feedback.joint_names_() == arm_joints() &&
           feedback.actual_().positions_().size() == arm_joints().size();
  }));
  expect_end(id, kSucceeded, kSuccessful, "Goal successfully reached!");
  EXPECT_TRUE(arm.status_becomes(id, kSucceeded));
  expect_end(id, kSucceeded, kSuccessful, "Goal successfully reached!");  // kept for later requests
}

TEST_F(FastActions, NewGoalPreemptsOld) {
  const Uuid old_one = new_id(), new_one = new_id();
  ASSERT_TRUE(arm.send(old_one, go_to(0.5, 1000)).value().accepted_());
  EXPECT_TRUE(arm.status_becomes(old_one, kExecuting));
  ASSERT_TRUE(arm.send(new_one, go_to(0.1, 0.5)).value().accepted_());
  expect_end(old_one, kAborted, kInvalidGoal, "Current goal preempted by new incoming action.");
  expect_end(new_one, kSucceeded, kSuccessful, "Goal successfully reached!");
}

TEST_F(FastActions, CancelEndsGoal) {
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

TEST_F(FastActions, ToleranceViolationAborts) {
  const Uuid id = new_id();
  Goal goal = go_to(1.0, 1);
  auto& tolerance = goal.path_tolerance_().emplace_back();
  tolerance.name_() = "Revolute 1";
  tolerance.position_() = 1e-9;  // no servo follows so closely
  ASSERT_TRUE(arm.send(id, goal).value().accepted_());
  expect_end(id, kAborted, kPathToleranceViolated, "Aborted due to path tolerance violation");
}

TEST_F(FastActions, GoalForUnknownJointsIsRejected) {
  const Uuid id = new_id();
  Goal goal = go_to(0.1, 0.5);
  goal.trajectory_().joint_names_()[2] = "no joint";
  const auto answer = arm.send(id, goal);
  ASSERT_TRUE(answer.has_value());
  EXPECT_FALSE(answer->accepted_());
  EXPECT_EQ(arm.result(id).value().status_(), 0) << "expected STATUS_UNKNOWN for a goal that was never sent";
}

}  // namespace
}  // namespace doppel::ros2_testing
