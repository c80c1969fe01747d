#pragma once
// The answers of the arms' services, on a worker's thread. None of them throws.

#include <functional>
#include <string>

#include "doppel/twin/arms/detail/arm_messages.h"
#include "doppel/twin/arms/detail/known_arms.h"

namespace doppel {

struct ArmContext {
  const ArmSnapshot& snapshot;
  KnownArms& arms;
  std::function<bool()> stopping;         // true: the twin ends, or a newer request has come
  std::function<void(std::string)> warn;  // logs a reason that has no place in the answer
};

template <class S>
using ArmAnswer = void (*)(const ArmContext&, const typename S::Request&, typename S::Response&);

void answer_position_ik(const ArmContext& context, const moveit_msgs::srv::GetPositionIK::Request& request,
                        moveit_msgs::srv::GetPositionIK::Response& response);
void answer_position_fk(const ArmContext& context, const moveit_msgs::srv::GetPositionFK::Request& request,
                        moveit_msgs::srv::GetPositionFK::Response& response);
void answer_state_validity(const ArmContext& context,
                           const moveit_msgs::srv::GetStateValidity::Request& request,
                           moveit_msgs::srv::GetStateValidity::Response& response);
void answer_solve_ik(const ArmContext& context, const doppel_msgs::srv::SolveIk::Request& request,
                     doppel_msgs::srv::SolveIk::Response& response);
void answer_list_arms(const ArmContext& context, const doppel_msgs::srv::ListArms::Request& request,
                      doppel_msgs::srv::ListArms::Response& response);
void answer_reach(const ArmContext& context, const doppel_msgs::srv::GetReach::Request& request,
                  doppel_msgs::srv::GetReach::Response& response);

// Responses of requests that are not answered, with the reason.
void refuse(moveit_msgs::srv::GetPositionIK::Response& response, const std::string& why);
void refuse(moveit_msgs::srv::GetPositionFK::Response& response, const std::string& why);
void refuse(moveit_msgs::srv::GetStateValidity::Response& response, const std::string& why);
void refuse(doppel_msgs::srv::SolveIk::Response& response, const std::string& why);
void refuse(doppel_msgs::srv::ListArms::Response& response, const std::string& why);
void refuse(doppel_msgs::srv::GetReach::Response& response, const std::string& why);

}  // namespace doppel
