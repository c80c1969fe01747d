#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/detail/pal_statistics_msgs.h"
#include "doppel/ros/messages/detail/registry.h"
#include "doppel/ros/messages/lifecycle_msgs.h"

namespace doppel::messages_detail {

namespace {

void register_controller_manager_msgs() {
  namespace msg = controller_manager_msgs::msg;
  namespace srv = controller_manager_msgs::srv;
  register_messages<msg::ChainConnection, msg::ControllerState, msg::HardwareInterface,
                    msg::HardwareComponentState, msg::NamedLifecycleState, msg::ControllerManagerActivity>();
  register_services<srv::ListControllers, srv::ListControllerTypes, srv::ListHardwareInterfaces,
                    srv::ListHardwareComponents, srv::LoadController, srv::ConfigureController,
                    srv::CleanupController, srv::UnloadController, srv::SwitchController,
                    srv::SetHardwareComponentState, srv::ReloadControllerLibraries>();
}

void register_lifecycle_msgs() {
  namespace msg = lifecycle_msgs::msg;
  namespace srv = lifecycle_msgs::srv;
  register_messages<msg::State, msg::Transition, msg::TransitionDescription, msg::TransitionEvent>();
  register_services<srv::ChangeState, srv::GetAvailableStates, srv::GetAvailableTransitions, srv::GetState>();
}

void register_pal_statistics_msgs() {
  namespace msg = pal_statistics_msgs::msg;
  register_messages<msg::Statistic, msg::Statistics, msg::StatisticsNames, msg::StatisticsValues>();
}

}  // namespace

void register_manager_types() {
  register_controller_manager_msgs();
  register_lifecycle_msgs();
  register_pal_statistics_msgs();
}

}  // namespace doppel::messages_detail
