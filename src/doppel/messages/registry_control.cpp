#include "doppel/messages/control_msgs.h"
#include "doppel/messages/controller_manager_msgs.h"
#include "doppel/messages/registry_detail.h"

namespace doppel::messages_detail {
namespace {

void register_controller_manager() {
  namespace msg = controller_manager_msgs::msg;
  namespace srv = controller_manager_msgs::srv;
  register_messages<lifecycle_msgs::msg::State, msg::ChainConnection, msg::ControllerState,
                    msg::HardwareInterface, msg::HardwareComponentState, msg::NamedLifecycleState,
                    msg::ControllerManagerActivity>();
  register_services<srv::ListControllers, srv::ListControllerTypes, srv::ListHardwareInterfaces,
                    srv::ListHardwareComponents, srv::LoadController, srv::ConfigureController,
                    srv::CleanupController, srv::UnloadController, srv::SwitchController,
                    srv::SetHardwareComponentState>();
}

}  // namespace

void register_control_types() {
  namespace msg = control_msgs::msg;
  namespace action = control_msgs::action;
  register_messages<msg::InterfaceValue, msg::DynamicJointState, msg::DynamicInterfaceGroupValues,
                    msg::GripperCommand, msg::JointTolerance, msg::JointComponentTolerance,
                    msg::JointTrajectoryControllerState, msg::SpeedScalingFactor, msg::PidState,
                    msg::MultiDOFCommand, msg::SingleDOFState, msg::SingleDOFStateStamped,
                    msg::MultiDOFStateStamped>();
  register_services<control_msgs::srv::QueryTrajectoryState>();
  register_actions<action::FollowJointTrajectory, action::GripperCommand, action::ParallelGripperCommand>();
  register_controller_manager();
}

}  // namespace doppel::messages_detail
