#pragma once
// Sends goals to an action, as rclcpp_action's client: three services and two topics under <action>/_action.

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "doppel/ros/messages/action_msgs.h"
#include "doppel/ros/network/node.h"

namespace doppel::ros2 {

template <Action A>
class ActionClient {
 public:
  // Called while the context spins; each may be empty.
  struct Callbacks {
    std::function<void(bool accepted)> on_response = {};
    std::function<void(const typename A::Feedback&)> on_feedback = {};
    std::function<void(GoalStatus, const typename A::Result&)> on_result = {};
  };

  // A sent goal; destroying this object does not cancel it.
  class Goal {
   public:
    [[nodiscard]] const GoalId& id() const { return id_; }
    [[nodiscard]] GoalStatus status() const { return status_; }  // unknown: not accepted yet
    [[nodiscard]] bool is_rejected() const { return rejected_; }
    // Rejected, or there is a result.
    [[nodiscard]] bool is_done() const { return rejected_ || is_terminal(status_); }
    [[nodiscard]] const typename A::Result& result() const { return result_; }  // once is_terminal(status())

   private:
    friend class ActionClient;
    GoalId id_{};
    GoalStatus status_ = GoalStatus::unknown;
    bool rejected_ = false;
    typename A::Result result_;
    Callbacks callbacks_;
  };

  ActionClient(Node& node, std::string_view action) : node_(node) {
    register_action(action_support<A>());
    const std::string prefix = std::string(action) + "/_action/";
    send_goal_ = node.create_client<SendGoal<A>>(prefix + "send_goal");
    get_result_ = node.create_client<GetResult<A>>(prefix + "get_result");
    cancel_goal_ = node.create_client<action_msgs::srv::CancelGoal>(prefix + "cancel_goal");
    node.create_subscription<FeedbackMessage<A>>(prefix + "feedback",
                                                 [goals = goals_](const FeedbackMessage<A>& message) {
                                                   const auto goal = find(*goals, message.goal_id.uuid);
                                                   if (goal != nullptr && goal->callbacks_.on_feedback)
                                                     goal->callbacks_.on_feedback(message.feedback);
                                                 });
    node.create_subscription<action_msgs::msg::GoalStatusArray>(
        prefix + "status",
        [goals = goals_](const action_msgs::msg::GoalStatusArray& message) {
          for (const auto& of_goal : message.status_list) {
            const auto goal = find(*goals, of_goal.goal_info.goal_id.uuid);
            const auto status = static_cast<GoalStatus>(of_goal.status);
            // The result has the final status, and may overtake the messages of earlier ones.
            if (goal != nullptr && !is_terminal(status) && !is_terminal(goal->status_))
              goal->status_ = status;
          }
        },
        {.depth = 1, .latched = true});
  }

  [[nodiscard]] bool action_server_is_ready() const {
    return send_goal_.service_is_ready() && get_result_.service_is_ready() && cancel_goal_.service_is_ready();
  }
  // Spins until the server is ready; false: the time is over.
  bool wait_for_action_server(std::chrono::nanoseconds at_most) const {
    return node_.context().spin_until([this] { return action_server_is_ready(); }, at_most);
  }

  std::shared_ptr<Goal> send_goal(const typename A::Goal& wanted, Callbacks callbacks = {}) {
    auto goal = std::make_shared<Goal>();
    goal->id_ = new_goal_id();
    goal->callbacks_ = std::move(callbacks);
    std::erase_if(*goals_, [](const auto& entry) { return entry.second.expired(); });
    (*goals_)[goal->id_] = goal;
    typename SendGoal<A>::Request request;
    request.goal_id.uuid = goal->id_;
    request.goal = wanted;
    send_goal_.async_send_request(
        request, [goal, get_result = get_result_](const typename SendGoal<A>::Response& response) {
          goal->rejected_ = !response.accepted;
          if (response.accepted && goal->status_ == GoalStatus::unknown) goal->status_ = GoalStatus::accepted;
          if (goal->callbacks_.on_response) goal->callbacks_.on_response(response.accepted);
          if (response.accepted) ask_for_result(goal, get_result);
        });
    return goal;
  }

  // Spins until the goal is done; false: the time is over.
  bool wait_for_result(const Goal& goal, std::chrono::nanoseconds at_most) const {
    return node_.context().spin_until([&] { return goal.is_done(); }, at_most);
  }

  // Requests the cancellation; `done` gets whether the server accepts it, the goal gets its final status.
  void cancel(const Goal& goal, std::function<void(bool canceling)> done = {}) const {
    action_msgs::srv::CancelGoal::Request request;
    request.goal_info.goal_id.uuid = goal.id();
    cancel_goal_.async_send_request(
        request, [call = std::move(done)](const action_msgs::srv::CancelGoal::Response& response) {
          if (call) call(!response.goals_canceling.empty());
        });
  }

 private:
  using Goals = std::map<GoalId, std::weak_ptr<Goal>>;

  static std::shared_ptr<Goal> find(const Goals& goals, const GoalId& id) {
    const auto found = goals.find(id);
    return found == goals.end() ? nullptr : found->second.lock();
  }

  static void ask_for_result(const std::shared_ptr<Goal>& goal, const Client<GetResult<A>>& get_result) {
    typename GetResult<A>::Request request;
    request.goal_id.uuid = goal->id_;
    get_result.async_send_request(request, [goal](const typename GetResult<A>::Response& response) {
      goal->status_ = static_cast<GoalStatus>(response.status);
      goal->result_ = response.result;
      if (goal->callbacks_.on_result) goal->callbacks_.on_result(goal->status_, goal->result_);
    });
  }

  Node& node_;
  Client<SendGoal<A>> send_goal_;
  Client<GetResult<A>> get_result_;
  Client<action_msgs::srv::CancelGoal> cancel_goal_;
  std::shared_ptr<Goals> goals_ = std::make_shared<Goals>();  // shared with the node's subscriptions
};

}  // namespace doppel::ros2
