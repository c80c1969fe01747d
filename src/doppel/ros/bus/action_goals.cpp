#include "doppel/ros/bus/action_goals.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>

namespace doppel {
namespace {

bool leads_to(GoalStatus from, GoalStatus to) {
  if (is_terminal(from) || from == GoalStatus::unknown) return false;
  switch (to) {
    case GoalStatus::executing:
      return from == GoalStatus::accepted;
    case GoalStatus::canceling:
      return from != GoalStatus::canceling;
    case GoalStatus::succeeded:
    case GoalStatus::canceled:
    case GoalStatus::aborted:
      return true;
    default:
      return false;
  }
}

bool cancelable(GoalStatus status) {
  return leads_to(status, GoalStatus::canceling);
}

}  // namespace

std::string to_string(const GoalId& id) {
  std::string text;
  for (const std::uint8_t byte : id) text += fmt::format("{:02x}", byte);
  return text;
}

GoalId new_goal_id() {
  std::random_device random;
  GoalId id;
  for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(random());
  id[6] = static_cast<std::uint8_t>((id[6] & 0x0F) | 0x40);
  id[8] = static_cast<std::uint8_t>((id[8] & 0x3F) | 0x80);
  return id;
}

const ActionGoals::Goal* ActionGoals::find(const GoalId& id) const {
  const auto found = std::ranges::find(goals_, id, &Goal::id);
  return found == goals_.end() ? nullptr : &*found;
}

bool ActionGoals::add(const GoalId& id, Time stamp) {
  if (find(id) != nullptr) return false;
  goals_.push_back({id, stamp});
  return true;
}

void ActionGoals::remove(const GoalId& id) {
  std::erase_if(goals_, [&id](const Goal& goal) { return goal.id == id; });
}

GoalStatus ActionGoals::status(const GoalId& id) const {
  const Goal* goal = find(id);
  return goal != nullptr ? goal->status : GoalStatus::unknown;
}

bool ActionGoals::change(const GoalId& id, GoalStatus to) {
  const auto goal = std::ranges::find(goals_, id, &Goal::id);
  if (goal == goals_.end() || !leads_to(goal->status, to)) return false;
  goal->status = to;
  return true;
}

void ActionGoals::finished(const GoalId& id, Time now) {
  const auto goal = std::ranges::find(goals_, id, &Goal::id);
  if (goal != goals_.end()) goal->ended = now;
}

std::vector<GoalId> ActionGoals::forget_expired(Time now) {
  const auto is_finished = [](const Goal& goal) { return is_terminal(goal.status); };
  auto count = static_cast<std::size_t>(std::ranges::count_if(goals_, is_finished));
  std::vector<GoalId> forgotten;
  std::erase_if(goals_, [&](const Goal& goal) {
    if (!is_finished(goal) || (count <= kKeptResults && now - goal.ended <= kResultTimeout)) return false;
    --count;
    forgotten.push_back(goal.id);
    return true;
  });
  return forgotten;
}

action_msgs::srv::CancelGoal::Response ActionGoals::cancel(
    const action_msgs::msg::GoalInfo& wanted, const std::function<Status(const GoalId&)>& accept) {
  using Response = action_msgs::srv::CancelGoal::Response;
  const GoalId& id = wanted.goal_id.uuid;
  const bool any_id = id == GoalId{};
  const Time until = from_msg(wanted.stamp);
  Response response;
  if (!any_id && until == Time{}) {
    const GoalStatus now = status(id);
    if (now == GoalStatus::unknown) response.return_code = Response::ERROR_UNKNOWN_GOAL_ID;
    if (!cancelable(now) && now != GoalStatus::unknown)
      response.return_code = Response::ERROR_GOAL_TERMINATED;  // as in rcl, also for a canceling goal
  }
  std::vector<Goal> meant;
  for (const Goal& goal : goals_) {
    const bool in_time = until == Time{} ? any_id : goal.stamp <= until;
    if ((goal.id == id || in_time) && cancelable(goal.status)) meant.push_back(goal);
  }
  for (const Goal& goal : meant) {
    if (!accept(goal.id)) continue;
    change(goal.id, GoalStatus::canceling);
    response.goals_canceling.push_back({{goal.id}, to_time_msg(goal.stamp)});
  }
  if (!meant.empty() && response.goals_canceling.empty()) response.return_code = Response::ERROR_REJECTED;
  return response;
}

action_msgs::msg::GoalStatusArray ActionGoals::status_message() const {
  action_msgs::msg::GoalStatusArray message;
  for (const Goal& goal : goals_) {
    message.status_list.push_back(
        {{{goal.id}, to_time_msg(goal.stamp)}, static_cast<std::int8_t>(goal.status)});
  }
  return message;
}

}  // namespace doppel
