#pragma once
// Actions as ROS 2 builds them, from services and topics of the bus: <name>/_action/send_goal, cancel_goal, get_result
// (services), feedback and status (topics). Everything runs on the loop's thread, between steps.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "doppel/bus/bus.h"
#include "doppel/messages/action_msgs.h"

namespace doppel {

using GoalId = std::array<std::uint8_t, 16>;

enum class GoalStatus : std::int8_t {  // action_msgs/msg/GoalStatus
  unknown = 0, accepted = 1, executing = 2, canceling = 3, succeeded = 4, canceled = 5, aborted = 6
};

template <Action A>
class ActionServer {
 public:
  struct Callbacks {
    // A refusal's reason is told to the client through the log; ROS 2's protocol carries only accepted or not.
    std::function<Status(const GoalId&, const typename A::Goal&)> on_goal;
    std::function<Status(const GoalId&)> on_cancel;
  };
  ActionServer(Node& node, std::string_view name, Callbacks callbacks);
  ~ActionServer();

  void publish_feedback(const GoalId& goal, const typename A::Feedback& feedback);
  // `terminal` is succeeded, canceled or aborted. Results are kept for clients that ask later (the last 16).
  void finish(const GoalId& goal, GoalStatus terminal, const typename A::Result& result);
  void set_executing(const GoalId& goal);
  void set_canceling(const GoalId& goal);

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace doppel

#include "doppel/bus/action_server_detail.h"
