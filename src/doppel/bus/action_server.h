#pragma once
// Actions as ROS 2 builds them, from services and topics of the bus: <name>/_action/send_goal, cancel_goal,
// get_result (services), feedback and status (topics). Everything runs on the loop's thread, between steps.

#include <functional>
#include <memory>
#include <string_view>

#include "doppel/bus/action_goals.h"
#include "doppel/bus/bus.h"
#include "doppel/messages/action_msgs.h"

namespace doppel {

template <Action A>
class ActionServer {
 public:
  struct Callbacks {
    // Decides and, if it takes the goal, begins it: it may call set_executing() and even finish(). A
    // refusal's reason is told to the client through /rosout; ROS 2's protocol carries only accepted or not.
    std::function<Status(const GoalId&, const typename A::Goal&)> on_goal;
    // An accepted cancellation makes the goal canceling, unless finish() is called right here. Empty: never
    // refused.
    std::function<Status(const GoalId&)> on_cancel;
  };
  // The node must outlive the server; a server recreated on the same node and name takes over.
  ActionServer(Node& node, std::string_view name, Callbacks callbacks);
  ~ActionServer();  // whoever waits for a result is told that the service went away
  ActionServer(const ActionServer&) = delete;
  ActionServer& operator=(const ActionServer&) = delete;

  void publish_feedback(const GoalId& goal, const typename A::Feedback& feedback);
  // `terminal` is succeeded, canceled or aborted, else std::logic_error. Results are kept for clients that
  // ask later (10 s of time, and the last 256). A goal that is unknown or finished already stays as it is.
  void finish(const GoalId& goal, GoalStatus terminal, const typename A::Result& result);
  void set_executing(const GoalId& goal);
  void set_canceling(const GoalId& goal);
  [[nodiscard]] GoalStatus status(const GoalId& goal) const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace doppel

#include "doppel/bus/detail/action_server.h"
