#pragma once
// ROS 2's action_msgs and unique_identifier_msgs, and the services and topics that rosidl derives
// from every action.

#include "doppel/ros/messages/builtin_interfaces.h"

namespace doppel::unique_identifier_msgs::msg {

struct UUID {
  std::array<std::uint8_t, 16> uuid{};
  DOPPEL_MESSAGE("unique_identifier_msgs/msg/UUID", uuid)
};

}  // namespace doppel::unique_identifier_msgs::msg

namespace doppel::action_msgs::msg {

struct GoalInfo {
  unique_identifier_msgs::msg::UUID goal_id;
  builtin_interfaces::msg::Time stamp;
  DOPPEL_MESSAGE("action_msgs/msg/GoalInfo", goal_id, stamp)
};

struct GoalStatus {
  static constexpr std::int8_t STATUS_UNKNOWN = 0, STATUS_ACCEPTED = 1, STATUS_EXECUTING = 2,
                               STATUS_CANCELING = 3, STATUS_SUCCEEDED = 4, STATUS_CANCELED = 5,
                               STATUS_ABORTED = 6;
  GoalInfo goal_info;
  std::int8_t status = STATUS_UNKNOWN;
  DOPPEL_MESSAGE("action_msgs/msg/GoalStatus", goal_info, status)
  DOPPEL_CONSTANTS(STATUS_UNKNOWN, STATUS_ACCEPTED, STATUS_EXECUTING, STATUS_CANCELING, STATUS_SUCCEEDED,
                   STATUS_CANCELED, STATUS_ABORTED)
};

struct GoalStatusArray {
  std::vector<GoalStatus> status_list;
  DOPPEL_MESSAGE("action_msgs/msg/GoalStatusArray", status_list)
};

}  // namespace doppel::action_msgs::msg

namespace doppel::action_msgs::srv {

struct CancelGoal {
  struct Request {
    msg::GoalInfo goal_info;
    DOPPEL_MESSAGE("action_msgs/srv/CancelGoal_Request", goal_info)
  };
  struct Response {
    static constexpr std::int8_t ERROR_NONE = 0, ERROR_REJECTED = 1, ERROR_UNKNOWN_GOAL_ID = 2,
                                 ERROR_GOAL_TERMINATED = 3;
    std::int8_t return_code = ERROR_NONE;
    std::vector<msg::GoalInfo> goals_canceling;
    DOPPEL_MESSAGE("action_msgs/srv/CancelGoal_Response", return_code, goals_canceling)
    DOPPEL_CONSTANTS(ERROR_NONE, ERROR_REJECTED, ERROR_UNKNOWN_GOAL_ID, ERROR_GOAL_TERMINATED)
  };
};

}  // namespace doppel::action_msgs::srv

namespace doppel {

namespace messages_detail {

// "<pkg>/action/<Name>" + Suffix as a compile-time string, from the goal's "<pkg>/action/<Name>_Goal".
template <Action A, const std::string_view& Suffix>
struct ActionTypeName {
  static constexpr std::string_view kBase = A::Goal::kType.substr(0, A::Goal::kType.size() - 5);
  static constexpr auto kChars = [] {
    std::array<char, kBase.size() + Suffix.size()> chars{};
    std::size_t i = 0;
    for (const char c : kBase) chars[i++] = c;
    for (const char c : Suffix) chars[i++] = c;
    return chars;
  }();
  static constexpr std::string_view kName{kChars.data(), kChars.size()};
};

inline constexpr std::string_view kSendGoalRequest = "_SendGoal_Request",
                                  kSendGoalResponse = "_SendGoal_Response",
                                  kGetResultRequest = "_GetResult_Request",
                                  kGetResultResponse = "_GetResult_Response",
                                  kFeedbackMessage = "_FeedbackMessage";

}  // namespace messages_detail

// <action>/_action/send_goal
template <Action A>
struct SendGoal {
  struct Request {
    unique_identifier_msgs::msg::UUID goal_id;
    typename A::Goal goal;
    DOPPEL_MESSAGE((messages_detail::ActionTypeName<A, messages_detail::kSendGoalRequest>::kName), goal_id,
                   goal)
  };
  struct Response {
    bool accepted = false;
    builtin_interfaces::msg::Time stamp;
    DOPPEL_MESSAGE((messages_detail::ActionTypeName<A, messages_detail::kSendGoalResponse>::kName), accepted,
                   stamp)
  };
};

// <action>/_action/get_result
template <Action A>
struct GetResult {
  struct Request {
    unique_identifier_msgs::msg::UUID goal_id;
    DOPPEL_MESSAGE((messages_detail::ActionTypeName<A, messages_detail::kGetResultRequest>::kName), goal_id)
  };
  struct Response {
    std::int8_t status = 0;
    typename A::Result result;
    DOPPEL_MESSAGE((messages_detail::ActionTypeName<A, messages_detail::kGetResultResponse>::kName), status,
                   result)
  };
};

// <action>/_action/feedback
template <Action A>
struct FeedbackMessage {
  unique_identifier_msgs::msg::UUID goal_id;
  typename A::Feedback feedback;
  DOPPEL_MESSAGE((messages_detail::ActionTypeName<A, messages_detail::kFeedbackMessage>::kName), goal_id,
                 feedback)
};

}  // namespace doppel
