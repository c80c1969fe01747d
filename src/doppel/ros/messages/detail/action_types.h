#pragma once
// The services and topics that rosidl derives from every action.

#include <array>
#include <string_view>

#include "doppel/ros/messages/action_msgs.h"

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
