// The types that every ROS 2 node uses.

#include "doppel/ros/messages/action_msgs.h"
#include "doppel/ros/messages/detail/composition_interfaces.h"
#include "doppel/ros/messages/detail/registry.h"
#include "doppel/ros/messages/detail/service_msgs.h"
#include "doppel/ros/messages/detail/statistics_msgs.h"
#include "doppel/ros/messages/rcl_interfaces.h"
#include "doppel/ros/messages/rmw_dds_common.h"
#include "doppel/ros/messages/type_description_interfaces.h"

namespace doppel::messages_detail {

namespace {

void register_rcl_interfaces() {
  namespace msg = rcl_interfaces::msg;
  namespace srv = rcl_interfaces::srv;
  register_messages<msg::Log, msg::ParameterType, msg::ParameterValue, msg::Parameter,
                    msg::FloatingPointRange, msg::IntegerRange, msg::ParameterDescriptor,
                    msg::SetParametersResult, msg::ListParametersResult, msg::ParameterEvent,
                    msg::LoggerLevel, msg::ParameterEventDescriptors, msg::SetLoggerLevelsResult>();
  register_services<srv::ListParameters, srv::GetParameters, srv::GetParameterTypes, srv::DescribeParameters,
                    srv::SetParameters, srv::SetParametersAtomically, srv::GetLoggerLevels,
                    srv::SetLoggerLevels>();
}

void register_unique_identifier_msgs() {
  namespace msg = unique_identifier_msgs::msg;
  register_messages<msg::UUID>();
}

void register_action_msgs() {
  namespace msg = action_msgs::msg;
  namespace srv = action_msgs::srv;
  register_messages<msg::GoalInfo, msg::GoalStatus, msg::GoalStatusArray>();
  register_services<srv::CancelGoal>();
}

void register_service_msgs() {
  namespace msg = service_msgs::msg;
  register_messages<msg::ServiceEventInfo>();
}

void register_type_description_interfaces() {
  namespace msg = type_description_interfaces::msg;
  namespace srv = type_description_interfaces::srv;
  register_messages<msg::FieldType, msg::Field, msg::IndividualTypeDescription, msg::TypeDescription,
                    msg::TypeSource, msg::KeyValue>();
  register_services<srv::GetTypeDescription>();
}

void register_composition_interfaces() {
  namespace srv = composition_interfaces::srv;
  register_services<srv::ListNodes, srv::LoadNode, srv::UnloadNode>();
}

void register_statistics_msgs() {
  namespace msg = statistics_msgs::msg;
  register_messages<msg::StatisticDataPoint, msg::MetricsMessage, msg::StatisticDataType>();
}

void register_rmw_dds_common() {
  namespace msg = rmw_dds_common::msg;
  register_messages<msg::Gid, msg::NodeEntitiesInfo, msg::ParticipantEntitiesInfo>();
}

}  // namespace

void register_rcl_types() {
  register_rcl_interfaces();
  register_unique_identifier_msgs();
  register_action_msgs();
  register_service_msgs();
  register_type_description_interfaces();
  register_composition_interfaces();
  register_statistics_msgs();
  register_rmw_dds_common();
}

}  // namespace doppel::messages_detail
