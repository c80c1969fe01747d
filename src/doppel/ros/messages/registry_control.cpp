#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/detail/registry.h"

namespace doppel::messages_detail {

void register_control_types() {
  namespace msg = control_msgs::msg;
  namespace srv = control_msgs::srv;
  namespace action = control_msgs::action;
  register_messages<msg::InterfaceValue, msg::DynamicJointState, msg::DynamicInterfaceGroupValues,
                    msg::GripperCommand, msg::JointTolerance, msg::JointComponentTolerance,
                    msg::JointTrajectoryControllerState, msg::SpeedScalingFactor, msg::PidState,
                    msg::MultiDOFCommand, msg::SingleDOFState, msg::SingleDOFStateStamped,
                    msg::MultiDOFStateStamped, msg::AdmittanceControllerState, msg::BatteryStateArray,
                    msg::DynamicInterfaceValues, msg::Float64Values, msg::JointControllerState, msg::JointJog,
                    msg::Keys, msg::MecanumDriveControllerState, msg::MotionArgument, msg::MotionPrimitive,
                    msg::MotionPrimitiveSequence, msg::SteeringControllerStatus, msg::VDA5050SafetyState>();
  register_services<srv::QueryTrajectoryState, srv::QueryCalibrationState, srv::SetOdometry>();
  register_actions<action::FollowJointTrajectory, action::GripperCommand, action::ParallelGripperCommand,
                   action::ExecuteMotionPrimitiveSequence, action::JointTrajectory, action::PointHead,
                   action::SingleJointPosition>();
}

}  // namespace doppel::messages_detail
