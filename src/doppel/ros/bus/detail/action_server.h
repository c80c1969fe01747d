#pragma once
// The implementation of an action server by services and topics.

#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel {

template <Action A>
struct ActionServer<A>::Impl {
  using ResultResponder = Responder<typename GetResult<A>::Response>;

  Bus& bus;
  std::string node_name;
  Callbacks callbacks;
  ActionGoals goals;
  bool deciding = false;  // a goal is only in the status topic once it is accepted
  std::map<GoalId, typename GetResult<A>::Response> results;
  std::map<GoalId, std::vector<ResultResponder>> waiting;
  Publisher<FeedbackMessage<A>> feedback;
  Publisher<action_msgs::msg::GoalStatusArray> status;
  Publisher<rcl_interfaces::msg::Log> log;
  FeedbackMessage<A> feedback_message;  // kept to reuse its memory

  Impl(Node& node, const std::string& prefix, Callbacks called)
      : bus(node.bus()),
        node_name(node.name()),
        callbacks(std::move(called)),
        feedback(node.advertise<FeedbackMessage<A>>(prefix + "feedback")),
        status(node.advertise<action_msgs::msg::GoalStatusArray>(prefix + "status",
                                                                 {.depth = 1, .latched = true})),
        log(node.advertise<rcl_interfaces::msg::Log>("/rosout", Qos::rosout())) {}

  void publish_status() {
    if (!deciding) status.publish(goals.status_message(), bus.now());
  }

  void change(const GoalId& goal, GoalStatus to) {
    if (goals.change(goal, to)) publish_status();
  }

  void refuse(const GoalId& goal, const std::string& why) {
    rcl_interfaces::msg::Log line;
    line.stamp = to_time_msg(bus.ros_now());
    line.level = rcl_interfaces::msg::Log::WARN;
    line.name = logger_name(node_name);
    line.msg = "goal " + to_string(goal) + " refused: " + why;
    log.publish(line, bus.now());
  }

  typename SendGoal<A>::Response send_goal(const typename SendGoal<A>::Request& request) {
    const GoalId& id = request.goal_id.uuid;
    typename SendGoal<A>::Response response;
    response.stamp = to_time_msg(bus.ros_now());
    Status decision = Status::refused("a goal with this id already exists");
    forget_expired();
    if (goals.add(id, bus.ros_now())) {
      deciding = true;
      decision = callbacks.on_goal ? callbacks.on_goal(id, request.goal) : Status();
      deciding = false;
      if (!decision) forget(id);
    }
    response.accepted = decision.ok();
    if (response.accepted) {
      publish_status();
    } else {
      refuse(id, decision.why());
    }
    return response;
  }

  void forget(const GoalId& id) {
    goals.remove(id);
    results.erase(id);
  }

  action_msgs::srv::CancelGoal::Response cancel(const action_msgs::srv::CancelGoal::Request& request) {
    auto response = goals.cancel(request.goal_info, [this](const GoalId& id) {
      return callbacks.on_cancel ? callbacks.on_cancel(id) : Status();
    });
    if (!response.goals_canceling.empty()) publish_status();
    return response;
  }

  void get_result(const GoalId& id, ResultResponder respond) {
    forget_expired();
    const GoalStatus now = goals.status(id);
    if (now == GoalStatus::unknown) return respond({});
    if (!is_terminal(now)) return waiting[id].push_back(std::move(respond));
    respond(results.at(id));
  }

  void finish(const GoalId& id, GoalStatus terminal, const typename A::Result& result) {
    if (!is_terminal(terminal)) throw std::logic_error("a goal finishes as succeeded, canceled or aborted");
    if (!goals.change(id, terminal)) return;
    const auto& stored = results[id] = {static_cast<std::int8_t>(terminal), result};
    publish_status();
    if (auto waiters = waiting.extract(id)) {
      for (const ResultResponder& respond : waiters.mapped()) respond(stored);
    }
    goals.finished(id, bus.now());
    forget_expired();
  }

  void forget_expired() {
    for (const GoalId& old : goals.forget_expired(bus.now())) results.erase(old);
  }
};

template <Action A>
ActionServer<A>::ActionServer(Node& node, std::string_view name, Callbacks callbacks) {
  register_action(action_support<A>());
  const std::string prefix = std::string(name) + "/_action/";
  impl_ = std::make_shared<Impl>(node, prefix, std::move(callbacks));
  // The services belong to the node and may outlive this server.
  const std::weak_ptr<Impl> weak = impl_;
  node.serve<SendGoal<A>>(prefix + "send_goal", [weak](const auto& request, const auto& respond) {
    if (const auto impl = weak.lock()) respond(impl->send_goal(request));
  });
  node.serve<action_msgs::srv::CancelGoal>(prefix + "cancel_goal",
                                           [weak](const auto& request, const auto& respond) {
                                             if (const auto impl = weak.lock())
                                               respond(impl->cancel(request));
                                           });
  node.serve<GetResult<A>>(prefix + "get_result", [weak](const auto& request, const auto& respond) {
    if (const auto impl = weak.lock()) impl->get_result(request.goal_id.uuid, respond);
  });
  impl_->publish_status();
}

template <Action A>
ActionServer<A>::~ActionServer() = default;

template <Action A>
void ActionServer<A>::publish_feedback(const GoalId& goal, const typename A::Feedback& feedback) {
  if (!impl_->feedback.has_listeners()) return;
  impl_->feedback_message.goal_id.uuid = goal;
  impl_->feedback_message.feedback = feedback;
  impl_->feedback.publish(impl_->feedback_message, impl_->bus.now());
}

template <Action A>
void ActionServer<A>::finish(const GoalId& goal, GoalStatus terminal, const typename A::Result& result) {
  impl_->finish(goal, terminal, result);
}

template <Action A>
void ActionServer<A>::set_executing(const GoalId& goal) {
  impl_->change(goal, GoalStatus::executing);
}

template <Action A>
void ActionServer<A>::set_canceling(const GoalId& goal) {
  impl_->change(goal, GoalStatus::canceling);
}

template <Action A>
GoalStatus ActionServer<A>::status(const GoalId& goal) const {
  return impl_->goals.status(goal);
}

}  // namespace doppel
