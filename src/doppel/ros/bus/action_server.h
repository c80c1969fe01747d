#pragma once
// Actions as in ROS 2, made of services and topics of the bus: <name>/_action/send_goal, cancel_goal,
// get_result (services), feedback and status (topics). Loop's thread only, between steps.

#include <functional>
#include <memory>
#include <string_view>

#include "doppel/ros/bus/action_goals.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/action_msgs.h"

namespace doppel {

template <Action A>
class ActionServer {
 public:
  struct Callbacks {
    // Accepts or refuses the goal and begins an accepted one: it may call set_executing() and also finish().
    // The reason of a refusal is published on /rosout; ROS 2's protocol has only accepted or not.
    std::function<Status(const GoalId&, const typename A::Goal&)> on_goal;
    // An accepted cancellation makes the goal canceling, unless finish() is called here.
    // Empty: always accepted.
    std::function<Status(const GoalId&)> on_cancel;
  };
  // The node outlives the server; a new server with the same node and name replaces it.
  ActionServer(Node& node, std::string_view name, Callbacks callbacks);
  ~ActionServer();  // pending requests for results get an error
  ActionServer(const ActionServer&) = delete;
  ActionServer& operator=(const ActionServer&) = delete;

  void publish_feedback(const GoalId& goal, const typename A::Feedback& feedback);
  // `terminal` is succeeded, canceled or aborted; throws std::logic_error otherwise. Results are kept for
  // later requests (for 10 s, and the last 256). No effect on an unknown or finished goal.
  void finish(const GoalId& goal, GoalStatus terminal, const typename A::Result& result);
  void set_executing(const GoalId& goal);
  void set_canceling(const GoalId& goal);
  [[nodiscard]] GoalStatus status(const GoalId& goal) const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace doppel

#include "doppel/ros/bus/detail/action_server.h"
