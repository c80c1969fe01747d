#pragma once
// The book-keeping of an action server that does not depend on the action's type: which goals there are and
// how each stands, by the state machine of ROS 2's action design (design.ros2.org/articles/actions.html).

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "doppel/core/status.h"
#include "doppel/core/time.h"
#include "doppel/export.h"
#include "doppel/messages/action_msgs.h"

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
// Random, as RFC 4122 (version 4) wants it.
DOPPEL_API GoalId new_goal_id();

class DOPPEL_API ActionGoals {
 public:
  // As rcl_action keeps them; the number keeps a flood of goals from filling the memory.
  static constexpr Duration kResultTimeout{10'000'000'000};
  static constexpr std::size_t kKeptResults = 256;

  // False: the id is in use.
  bool add(const GoalId& id, Time stamp);
  void remove(const GoalId& id);
  [[nodiscard]] GoalStatus status(const GoalId& id) const;  // unknown: no such goal
  // False, and nothing happens, if the goal is unknown or the state machine does not lead from its status to
  // `to`.
  bool change(const GoalId& id, GoalStatus to);
  // `now`: when it reached its end, from where its result is kept.
  void finished(const GoalId& id, Time now);
  // Goals whose end lies kResultTimeout back, or beyond the last kKeptResults; they are forgotten here, their
  // results are the caller's to forget.
  std::vector<GoalId> forget_expired(Time now);

  // Which goals a request means (a zero id and a zero stamp: all), asking `accept` for each that is not
  // finished or canceling already. An accepted one is canceling afterwards, unless `accept` has finished it
  // at once.
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
