// Services as a ROS 2 process on Fast DDS calls them.

#include <control_msgs.h>
#include <controller_manager_msgs.h>
#include <gtest/gtest.h>
#include <rcl_interfaces.h>
#include <rosgraph_msgs.h>
#include <std_srvs.h>

#include "fast_twin_test.h"

namespace doppel::ros2_testing {
namespace {

using namespace controller_manager_msgs::srv::dds_;  // NOLINT
using namespace rcl_interfaces::srv::dds_;           // NOLINT
using rcl_interfaces::msg::dds_::Parameter_;
constexpr std::uint8_t kDouble = 3;

class FastServices : public FastTwinTest {};

using ListControllers = ServiceClient<ListControllers_Request_, ListControllers_Response_>;
using GetParameters = ServiceClient<GetParameters_Request_, GetParameters_Response_>;
using SetParameters = ServiceClient<SetParameters_Request_, SetParameters_Response_>;
using Trigger = ServiceClient<std_srvs::srv::dds_::Empty_Request_, std_srvs::srv::dds_::Empty_Response_>;

std::map<std::string, std::string> states_of(const ListControllers_Response_& response) {
  std::map<std::string, std::string> states;
  for (const auto& controller : response.controller_()) states[controller.name_()] = controller.state_();
  return states;
}

TEST_F(FastServices, ListsControllers) {
  ListControllers list(peer, "/controller_manager/list_controllers");
  const auto response = list.call({});
  ASSERT_TRUE(response.has_value());
  EXPECT_EQ(states_of(*response),
            (std::map<std::string, std::string>{{"joint_state_broadcaster", "active"},
                                                {"omarm_arm_controller", "active"},
                                                {"omarm_gripper_controller", "active"}}));
}

TEST_F(FastServices, SwitchesControllerOffAndOn) {
  ListControllers list(peer, "/controller_manager/list_controllers");
  ServiceClient<SwitchController_Request_, SwitchController_Response_> change(
      peer, "/controller_manager/switch_controller");
  SwitchController_Request_ off, on;
  off.deactivate_controllers_() = on.activate_controllers_() = {"omarm_gripper_controller"};
  off.strictness_() = on.strictness_() = 2;  // STRICT
  for (const auto& [request, state] : {std::pair(off, "inactive"), std::pair(on, "active")}) {
    const auto response = change.call(request);
    ASSERT_TRUE(response.has_value());
    EXPECT_TRUE(response->ok_());
    EXPECT_EQ(states_of(list.call({}).value())["omarm_gripper_controller"], state);
  }
}

TEST_F(FastServices, SetsAndGetsParameter) {
  GetParameters get(peer, "/omarm_arm_controller/get_parameters");
  SetParameters set(peer, "/omarm_arm_controller/set_parameters");
  Parameter_ parameter;
  parameter.name_() = "constraints.Revolute 1.goal";
  parameter.value_().type_() = kDouble;
  parameter.value_().double_value_() = 0.125;
  SetParameters_Request_ request;
  request.parameters_() = {parameter};
  const auto answer = set.call(request);
  ASSERT_TRUE(answer.has_value());
  ASSERT_EQ(answer->results_().size(), 1u);
  EXPECT_TRUE(answer->results_()[0].successful_()) << answer->results_()[0].reason_();

  GetParameters_Request_ question;
  question.names_() = {"constraints.Revolute 1.goal"};
  const auto values = get.call(question);
  ASSERT_TRUE(values.has_value());
  ASSERT_EQ(values->values_().size(), 1u);
  EXPECT_EQ(values->values_()[0].type_(), kDouble);
  EXPECT_EQ(values->values_()[0].double_value_(), 0.125);
  question.names_().push_back("no.such.parameter");
  const auto with_unknown = get.call(question);
  ASSERT_TRUE(with_unknown.has_value());
  ASSERT_EQ(with_unknown->values_().size(), 2u)
      << "expected two values: controllers allow undeclared parameters";
  EXPECT_EQ(with_unknown->values_()[0].double_value_(), 0.125);
  EXPECT_EQ(with_unknown->values_()[1].type_(), 0) << "expected the type of a parameter that is not set";

  request.parameters_()[0].value_().double_value_() = 0;
  set.call(request);
}

TEST_F(FastServices, ParameterOfAnotherTypeIsRefused) {
  SetParameters set(peer, "/omarm_arm_controller/set_parameters");
  SetParameters_Request_ request;
  request.parameters_().resize(1);
  request.parameters_()[0].name_() = "constraints.Revolute 1.goal";
  request.parameters_()[0].value_().type_() = 4;  // a string
  request.parameters_()[0].value_().string_value_() = "wide";
  const auto answer = set.call(request);
  ASSERT_TRUE(answer.has_value());
  ASSERT_EQ(answer->results_().size(), 1u);
  EXPECT_FALSE(answer->results_()[0].successful_());
  EXPECT_FALSE(answer->results_()[0].reason_().empty());
}

TEST_F(FastServices, QueryStateReturnsTrajectoryState) {
  using control_msgs::srv::dds_::QueryTrajectoryState_Request_;
  using control_msgs::srv::dds_::QueryTrajectoryState_Response_;
  ServiceClient<QueryTrajectoryState_Request_, QueryTrajectoryState_Response_> query(
      peer, "/omarm_arm_controller/query_state");
  QueryTrajectoryState_Request_ long_after;  // the end of every trajectory
  long_after.time_().sec_() = 1'000'000;
  const auto response = query.call(long_after);
  ASSERT_TRUE(response.has_value());
  EXPECT_FALSE(response->success_());
}

TEST_F(FastServices, PausesTime) {
  Trigger pause(peer, "/gazebo/pause_physics"), unpause(peer, "/gazebo/unpause_physics");
  auto clock = peer.subscribe<rosgraph_msgs::msg::dds_::Clock_>("rt/clock");
  ASSERT_TRUE(clock.next().has_value());
  ASSERT_TRUE(pause.call({}).has_value());
  // Messages in transit at the response still arrive; after that none with a later time, however often the
  // loop answers.
  ASSERT_TRUE(pause.call({}).has_value());
  clock.forget_all();
  ListControllers list(peer, "/controller_manager/list_controllers");
  ASSERT_TRUE(list.call({}).has_value()) << "expected services to be answered while paused";
  std::set<std::int64_t> times;
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(list.call({}).has_value());
    while (const auto tick = clock.take()) {
      const auto& time = tick->value.clock_();
      times.insert(time.sec_() * std::int64_t{1'000'000'000} + time.nanosec_());
    }
  }
  EXPECT_LE(times.size(), 1u) << "expected time to stop";
  ASSERT_TRUE(unpause.call({}).has_value());
  EXPECT_TRUE(clock.next([&](const auto& tick) {
    const auto& time = tick.clock_();
    return times.empty() || time.sec_() * std::int64_t{1'000'000'000} + time.nanosec_() > *times.rbegin();
  })) << "expected time to continue";
}

// Responses reach every client of the service; the identity in them selects the client.
TEST_F(FastServices, TwoClientsReceiveOwnResponses) {
  FastPeer other_peer(own_domain());
  GetParameters here(peer, "/omarm_arm_controller/get_parameters");
  GetParameters there(other_peer, "/omarm_arm_controller/get_parameters");
  ASSERT_TRUE(here.wait_for_service());
  ASSERT_TRUE(there.wait_for_service());
  constexpr int kCalls = 20;
  GetParameters_Request_ one, two;
  one.names_() = {"joints"};
  two.names_() = {"joints", "command_interfaces"};
  for (int i = 0; i < kCalls; ++i) {
    const std::int64_t sent_here = here.send(one), sent_there = there.send(two);
    std::optional<GetParameters_Response_> a, b;
    ASSERT_TRUE(eventually([&] { return (a = here.answer(sent_here)).has_value(); }));
    ASSERT_TRUE(eventually([&] { return (b = there.answer(sent_there)).has_value(); }));
    EXPECT_EQ(a->values_().size(), 1u);
    EXPECT_EQ(b->values_().size(), 2u);
  }
  EXPECT_EQ(here.own(), static_cast<std::size_t>(kCalls)) << "expected one response for each request";
  EXPECT_EQ(there.own(), static_cast<std::size_t>(kCalls));
}

}  // namespace
}  // namespace doppel::ros2_testing
