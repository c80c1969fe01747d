// The action protocol as a client at an edge sees it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {
namespace {

using Move = control_msgs::action::GripperCommand;
using Cancel = action_msgs::srv::CancelGoal;
using std::chrono::seconds;
using testing::HasSubstr;

GoalId id_of(std::uint8_t number) {
  GoalId id{};
  id[0] = number;
  return id;
}

class ActionServerTest : public testing::Test {
 protected:
  ActionServerTest() { make_server(); }

  void make_server() {
    server_ = std::make_unique<ActionServer<Move>>(
        node_, "~/move",
        ActionServer<Move>::Callbacks{[this](const GoalId& id, const Move::Goal& goal) {
                                        if (goal.command.position < 0)
                                          return Status::refused("behind the stop");
                                        if (goal.command.position == 0)
                                          server_->finish(id, GoalStatus::succeeded, {0, 0, false, true});
                                        return Status();
                                      },
                                      [this](const GoalId&) { return cancel_decision_; }});
  }

  // Fills in `response` when the answer comes; a rejection leaves its reason in why_.
  template <class S>
  void call(const std::string& service, const typename S::Request& request,
            std::optional<typename S::Response>& response) {
    edge_->call("/n/move/_action/" + service, to_cdr(request), [&](const Status& status, const Bytes& bytes) {
      why_ = status.why();
      EXPECT_TRUE(!status || from_cdr(bytes, response.emplace()));
    });
    bus_.spin();
  }

  bool send(std::uint8_t number, double position) {
    std::optional<SendGoal<Move>::Response> response;
    call<SendGoal<Move>>("send_goal", {{id_of(number)}, {{position, 1}}}, response);
    return response.value().accepted;
  }
  Cancel::Response cancel(const GoalId& id, Time stamp = {}) {
    std::optional<Cancel::Response> response;
    call<Cancel>("cancel_goal", {{{id}, to_time_msg(stamp)}}, response);
    return response.value();
  }
  std::optional<GetResult<Move>::Response> result(std::uint8_t number) {
    std::optional<GetResult<Move>::Response> response;
    call<GetResult<Move>>("get_result", {{id_of(number)}}, response);
    return response;
  }

  Bus bus_;
  Node node_{bus_, "/n"};
  std::unique_ptr<Edge> edge_ = bus_.attach("edge");
  std::unique_ptr<ActionServer<Move>> server_;
  Status cancel_decision_;
  std::string why_;
};

TEST_F(ActionServerTest, AcceptedGoalReachesResult) {
  std::vector<std::vector<int>> statuses;
  node_.subscribe<action_msgs::msg::GoalStatusArray>("~/move/_action/status", [&](const auto& message) {
    auto& list = statuses.emplace_back();
    for (const auto& goal : message.status_list) list.push_back(goal.status);
  });
  int feedback = 0;
  node_.subscribe<FeedbackMessage<Move>>("~/move/_action/feedback", [&](const auto& message) {
    EXPECT_EQ(message.goal_id.uuid, id_of(1));
    feedback += static_cast<int>(message.feedback.position);
  });
  EXPECT_TRUE(send(1, 0.5));
  EXPECT_FALSE(send(1, 0.5)) << "expected a rejection: the id is in use";
  server_->set_executing(id_of(1));
  server_->publish_feedback(id_of(1), {7, 0, false, false});
  EXPECT_EQ(feedback, 7);
  std::optional<GetResult<Move>::Response> response;
  call<GetResult<Move>>("get_result", {{id_of(1)}}, response);
  EXPECT_FALSE(response) << "expected no response before the goal is finished";
  server_->finish(id_of(1), GoalStatus::succeeded, {0.5, 0, false, true});
  ASSERT_TRUE(response);
  EXPECT_EQ(response->status, 4);
  EXPECT_TRUE(response->result.reached_goal);
  EXPECT_EQ(result(1)->status, 4) << "expected the result to be kept for later requests";
  server_->finish(id_of(1), GoalStatus::aborted, {});
  EXPECT_EQ(result(1)->status, 4) << "expected the status of a finished goal to stay the same";
  EXPECT_EQ(statuses, (std::vector<std::vector<int>>{{}, {1}, {2}, {4}}));
  EXPECT_EQ(result(9)->status, 0) << "expected status 0 for an unknown goal";
}

TEST_F(ActionServerTest, RejectedGoalIsLogged) {
  std::string line;
  node_.subscribe<rcl_interfaces::msg::Log>("/rosout", [&](const auto& log) { line = log.msg; });
  EXPECT_FALSE(send(1, -1));
  EXPECT_THAT(line, HasSubstr("behind the stop"));
  EXPECT_EQ(result(1)->status, 0);
  EXPECT_TRUE(send(2, 0)) << "expected a goal that finishes at once to be accepted";
  EXPECT_EQ(result(2)->status, 4);
}

TEST_F(ActionServerTest, CancelRequestSelectsOneAllOrEarlierGoals) {
  using Code = Cancel::Response;
  bus_.set_now(Time(seconds(1)));
  send(1, 1);
  bus_.set_now(Time(seconds(2)));
  send(2, 1);
  bus_.set_now(Time(seconds(3)));
  send(3, 1);
  EXPECT_EQ(cancel(id_of(9)).return_code, Code::ERROR_UNKNOWN_GOAL_ID);
  cancel_decision_ = Status::refused("no");
  EXPECT_EQ(cancel(id_of(1)).return_code, Code::ERROR_REJECTED);
  cancel_decision_ = {};
  const auto one = cancel(id_of(2));
  EXPECT_EQ(one.return_code, Code::ERROR_NONE);
  ASSERT_EQ(one.goals_canceling.size(), 1U);
  EXPECT_EQ(server_->status(id_of(1)), GoalStatus::accepted);
  EXPECT_EQ(server_->status(id_of(2)), GoalStatus::canceling);
  server_->finish(id_of(2), GoalStatus::canceled, {});
  EXPECT_EQ(cancel(id_of(2)).return_code, Code::ERROR_GOAL_TERMINATED);
  EXPECT_EQ(cancel({}, Time(seconds(2))).goals_canceling.size(), 1U)
      << "expected the first only; the second is finished, the third is later";
  EXPECT_EQ(cancel(id_of(1)).return_code, Code::ERROR_GOAL_TERMINATED)
      << "expected rcl's answer for a goal that is already canceling";
  EXPECT_EQ(cancel({}).goals_canceling.size(), 1U)
      << "expected the third only; the first is already canceling";
  EXPECT_EQ(server_->status(id_of(3)), GoalStatus::canceling);
}

TEST_F(ActionServerTest, ResultsAreKeptForTenSeconds) {
  bus_.set_now(Time(seconds(1)));
  send(1, 1);
  bus_.set_now(Time(seconds(20)));
  server_->finish(id_of(1), GoalStatus::succeeded, {});
  bus_.set_now(Time(seconds(30)));
  EXPECT_EQ(result(1)->status, 4);
  bus_.set_now(Time(seconds(31)));
  EXPECT_EQ(result(1)->status, 0);
}

TEST_F(ActionServerTest, ManyGoalsAreForgottenSooner) {
  for (int i = 0; i < 300; ++i) {
    GoalId id{};
    id[0] = static_cast<std::uint8_t>(i);
    id[1] = static_cast<std::uint8_t>(1 + i / 256);
    std::optional<SendGoal<Move>::Response> response;
    call<SendGoal<Move>>("send_goal", {{id}, {{0, 0}}}, response);
  }
  std::size_t kept = 0;
  node_.subscribe<action_msgs::msg::GoalStatusArray>(
      "~/move/_action/status", [&](const auto& message) { kept = message.status_list.size(); });
  EXPECT_EQ(kept, ActionGoals::kKeptResults) << "expected the number that was published with the last goal";
}

TEST_F(ActionServerTest, ServerWithOpenGoalsCanBeRecreated) {
  send(1, 1);
  std::optional<GetResult<Move>::Response> response;
  call<GetResult<Move>>("get_result", {{id_of(1)}}, response);
  server_.reset();
  EXPECT_THAT(why_, HasSubstr("was removed"));
  std::optional<SendGoal<Move>::Response> refused;
  call<SendGoal<Move>>("send_goal", {{id_of(2)}, {}}, refused);
  EXPECT_FALSE(refused);
  make_server();
  EXPECT_TRUE(send(1, 1));
  EXPECT_THROW(server_->finish(id_of(1), GoalStatus::executing, {}), std::logic_error);
}

}  // namespace
}  // namespace doppel
