// GripperCommand and ParallelGripperCommand as an action client on Fast DDS uses them, with a twin whose
// gripper has controllers of both types: to success, stalling, preemption and cancel.

#include <controller_manager_msgs.h>
#include <gtest/gtest.h>

#include <cmath>

#include "fast_action_client.h"
#include "fast_twin_test.h"

namespace doppel::ros2_testing {
namespace {

using namespace control_msgs::action::dds_;  // NOLINT

constexpr const char* kJoint = "Revolute 8";
constexpr double kOpen = 1.2, kWidest = 1.6, kBeyond = 2.0;  // rad: inside, at and beyond the joint's limit
constexpr double kTolerance = 0.01;                          // goal_tolerance's default

struct GripperCommand {
  using Goal = GripperCommand_Goal_;
  using SendGoalRequest = GripperCommand_SendGoal_Request_;
  using SendGoalResponse = GripperCommand_SendGoal_Response_;
  using GetResultRequest = GripperCommand_GetResult_Request_;
  using GetResultResponse = GripperCommand_GetResult_Response_;
  using FeedbackMessage = GripperCommand_FeedbackMessage_;
  static constexpr const char* kController = "gripper";

  static Goal go_to(double position) {
    Goal goal;
    goal.command_().position_() = position;
    goal.command_().max_effort_() = 0.1;
    return goal;
  }
  static std::optional<double> position(const auto& message) { return message.position_(); }
};

struct ParallelGripperCommand {
  using Goal = ParallelGripperCommand_Goal_;
  using SendGoalRequest = ParallelGripperCommand_SendGoal_Request_;
  using SendGoalResponse = ParallelGripperCommand_SendGoal_Response_;
  using GetResultRequest = ParallelGripperCommand_GetResult_Request_;
  using GetResultResponse = ParallelGripperCommand_GetResult_Response_;
  using FeedbackMessage = ParallelGripperCommand_FeedbackMessage_;
  static constexpr const char* kController = "parallel_gripper";

  static Goal go_to(double position) {
    Goal goal;
    goal.command_().position_() = {position};
    goal.command_().effort_() = {0.1};
    return goal;
  }
  static std::optional<double> position(const auto& message) {
    const auto& state = message.state_();
    if (state.name_() != std::vector<std::string>{kJoint} || state.position_().size() != 1)
      return std::nullopt;
    return state.position_()[0];
  }
};

// The one twin for both types.
TwinProcess& twin_with_grippers() {
  static TwinProcess process({"--controllers", source_folder() / "tests/ros2/grippers.yaml", "--activate",
                              "joint_state_broadcaster", "arm"});
  return process;
}

template <class A>
class FastGrippers : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(twin_with_grippers().process().running()) << twin_with_grippers().output();
  }
  void TearDown() override {
    if (HasFailure()) std::fputs(twin_with_grippers().output().c_str(), stderr);
  }

  // The client of this controller's action; this controller alone is then active.
  ActionClient<A> start(const std::string& controller) {
    using namespace controller_manager_msgs::srv::dds_;  // NOLINT
    ServiceClient<SwitchController_Request_, SwitchController_Response_> change(
        peer, "/controller_manager/switch_controller");
    SwitchController_Request_ request;
    request.strictness_() = 1;  // BEST_EFFORT: most of them are inactive already
    for (const char* each : {"gripper", "patient_gripper", "parallel_gripper", "patient_parallel_gripper"})
      if (each != controller) request.deactivate_controllers_().push_back(each);
    request.activate_controllers_() = {controller};
    const auto answer = change.call(request);
    EXPECT_TRUE(answer.has_value() && answer->ok_()) << "expected a switch to " << controller;
    ActionClient<A> client(peer, "/" + controller + "/gripper_cmd");
    EXPECT_TRUE(client.wait_for_server()) << "expected the action's five topics and services";
    return client;
  }
  ActionClient<A> start_quick() { return start(A::kController); }
  ActionClient<A> start_patient() { return start(std::string("patient_") + A::kController); }

  // Whether the goal was accepted and is executed.
  static bool executes(ActionClient<A>& client, const Uuid& id, double position) {
    const auto answer = client.send(id, A::go_to(position));
    return answer.has_value() && answer->accepted_() && client.status_becomes(id, kExecuting);
  }

  FastPeer peer{own_domain()};
};

using Actions = ::testing::Types<GripperCommand, ParallelGripperCommand>;
TYPED_TEST_SUITE(FastGrippers, Actions);

TYPED_TEST(FastGrippers, GripperClosesAndOpens) {
  auto gripper = this->start_quick();
  for (const double position : {0.0, kOpen}) {
    const Uuid id = new_id();
    const auto accepted = gripper.send(id, TypeParam::go_to(position));
    ASSERT_TRUE(accepted.has_value());
    EXPECT_TRUE(accepted->accepted_());
    const auto result = gripper.result(id);
    ASSERT_TRUE(result.has_value()) << "expected a result";
    EXPECT_EQ(result->status_(), kSucceeded);
    EXPECT_TRUE(result->result_().reached_goal_());
    EXPECT_FALSE(result->result_().stalled_());
    EXPECT_NEAR(TypeParam::position(result->result_()).value_or(-1), position, kTolerance);
    EXPECT_TRUE(gripper.status_becomes(id, kSucceeded));
  }
}

TYPED_TEST(FastGrippers, StallAborts) {
  auto gripper = this->start_quick();
  const Uuid id = new_id();
  ASSERT_TRUE(gripper.send(id, TypeParam::go_to(kBeyond)).value().accepted_());
  const auto result = gripper.result(id);
  ASSERT_TRUE(result.has_value()) << "expected a result";
  EXPECT_EQ(result->status_(), kAborted);
  EXPECT_FALSE(result->result_().reached_goal_());
  EXPECT_TRUE(result->result_().stalled_());
  EXPECT_NEAR(TypeParam::position(result->result_()).value_or(-1), kWidest, 0.05);
}

TYPED_TEST(FastGrippers, NewGoalPreemptsOld) {
  auto gripper = this->start_patient();
  const Uuid old_one = new_id(), new_one = new_id();
  ASSERT_TRUE(this->executes(gripper, old_one, kBeyond));
  ASSERT_TRUE(gripper.send(new_one, TypeParam::go_to(kOpen)).value().accepted_());
  const auto preempted = gripper.result(old_one), reached = gripper.result(new_one);
  ASSERT_TRUE(preempted.has_value() && reached.has_value());
  EXPECT_EQ(preempted->status_(), kCanceled) << "expected the status of preempted goals in ros2_controllers";
  EXPECT_FALSE(preempted->result_().reached_goal_());
  EXPECT_EQ(reached->status_(), kSucceeded);
}

TYPED_TEST(FastGrippers, CancelEndsGoal) {
  auto gripper = this->start_patient();
  const Uuid id = new_id();
  ASSERT_TRUE(this->executes(gripper, id, kBeyond));
  EXPECT_TRUE(gripper.feedback_about(
      id, [](const auto& feedback) { return TypeParam::position(feedback).has_value(); }));
  const auto answer = gripper.cancel(id);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->return_code_(), 0);  // ERROR_NONE
  ASSERT_EQ(answer->goals_canceling_().size(), 1u);
  EXPECT_EQ(answer->goals_canceling_()[0].goal_id_().uuid_(), id);
  EXPECT_EQ(gripper.result(id).value().status_(), kCanceled);
  EXPECT_TRUE(gripper.status_becomes(id, kCanceled));
  EXPECT_EQ(gripper.cancel(id).value().return_code_(), 3);  // ERROR_GOAL_TERMINATED
}

// What is not a valid goal: a position that is NaN, or not exactly one position.
GripperCommand::Goal impossible(GripperCommand) {
  return GripperCommand::go_to(std::nan(""));
}
ParallelGripperCommand::Goal impossible(ParallelGripperCommand) {
  return {};
}

TYPED_TEST(FastGrippers, InvalidPositionIsRejected) {
  auto gripper = this->start_quick();
  const Uuid id = new_id();
  const auto answer = gripper.send(id, impossible(TypeParam()));
  ASSERT_TRUE(answer.has_value());
  EXPECT_FALSE(answer->accepted_());
  EXPECT_EQ(gripper.result(id).value().status_(), 0)
      << "expected STATUS_UNKNOWN for a goal that was never sent";
}

}  // namespace
}  // namespace doppel::ros2_testing
