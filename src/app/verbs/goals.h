#pragma once
// A client's goal of an action, by ROS 2's services and topics under <action>/_action.

#include <string>
#include <string_view>

#include "app/verbs/shell.h"
#include "doppel/ros/bus/action_goals.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel::app {

std::string_view status_name(std::int8_t status);  // of action_msgs/msg/GoalStatus
constexpr std::int8_t kSucceeded = 4;
inline constexpr std::string_view kSendGoal = "/_action/send_goal";  // behind the name of each action

struct GoalOutcome {
  std::int8_t status = 0;
  std::string result_yaml;
  std::string reason;  // of a failure, as the result describes it; empty: it does not
};

class ActionGoal {
 public:
  // Sends the goal; throws ClientError if the action does not exist, or with the reason if it rejects the
  // goal.
  ActionGoal(Client& twin, std::string action, const ActionSupport& type,
             std::span<const std::byte> goal_cdr);

  [[nodiscard]] const GoalId& id() const { return id_; }
  [[nodiscard]] std::string feedback_topic() const { return action_ + "/_action/feedback"; }
  // The feedback in a message of that topic as YAML; "" if it is of another topic or goal.
  [[nodiscard]] std::string feedback_yaml(const Client::Received& message) const;
  // True if the result has arrived; it is requested when the goal is sent.
  bool take_outcome(GoalOutcome& outcome);
  void cancel();

 private:
  Client& twin_;
  std::string action_;
  const ActionSupport& type_;
  GoalId id_;
  std::uint32_t result_call_ = 0;
};

// The type of an action that the twin offers; throws ClientError with the nearest name.
std::string find_action_type(Client& twin, const std::string& action);
std::vector<std::string> action_list(Client& twin);

}  // namespace doppel::app
