#pragma once
// The goals of an action server and their states, independent of the action's type, by the state machine of
// ROS 2's action design (design.ros2.org/articles/actions.html). The loop's thread.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/ros/messages/action_msgs.h"

namespace doppel {

using GoalId = std::array<std::uint8_t, 16>;

enum class GoalStatus : std::int8_t {  // action_msgs/msg/GoalStatus
  unknown = 0,
  accepted = 1,
  executing = 2,
  canceling = 3,
  succeeded = 4,
  canceled = 5,
  aborted = 6
};

constexpr bool is_terminal(GoalStatus status) {
  return status >= GoalStatus::succeeded;
}

// "5f0c...": the id as 32 hexadecimal digits.
DOPPEL_API std::string to_string(const GoalId& id);
// Random, version 4 of RFC 4122.
DOPPEL_API GoalId new_goal_id();

class DOPPEL_API ActionGoals {
 public:
  // The time is rcl_action's; the number limits the memory of a flood of goals.
  static constexpr Duration kResultTimeout{10'000'000'000};
  static constexpr std::size_t kKeptResults = 256;

  // False: the id is already used.
  bool add(const GoalId& id, Time stamp);
  void remove(const GoalId& id);
  [[nodiscard]] GoalStatus status(const GoalId& id) const;  // unknown: no such goal
  // False, without effect, if the goal is unknown or the state machine has no transition from its
  // status to `to`.
  bool change(const GoalId& id, GoalStatus to);
  // `now`: when it ended, from which kResultTimeout is counted.
  void finished(const GoalId& id, Time now);
  // Removes and returns the goals that ended more than kResultTimeout ago, or before the last kKeptResults;
  // the caller removes their results.
  std::vector<GoalId> forget_expired(Time now);

  // Cancels the goals that a request selects (a zero id and a zero stamp: all): calls `accept` for each
  // that is neither finished nor canceling. An accepted one is canceling afterwards, unless `accept`
  // has finished it.
  action_msgs::srv::CancelGoal::Response cancel(const action_msgs::msg::GoalInfo& wanted,
                                                const std::function<Status(const GoalId&)>& accept);

  [[nodiscard]] action_msgs::msg::GoalStatusArray status_message() const;

 private:
  struct Goal {
    GoalId id{};
    Time stamp{};
    GoalStatus status = GoalStatus::accepted;
    Time ended{};  // of a finished one
  };
  [[nodiscard]] const Goal* find(const GoalId& id) const;

  std::vector<Goal> goals_;  // in order of arrival
};

}  // namespace doppel
