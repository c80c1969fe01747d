#include "doppel/messages/rcl_interfaces.h"
#include "doppel/messages/registry_detail.h"
#include "doppel/messages/service_msgs.h"
#include "doppel/messages/type_description_interfaces.h"

namespace doppel::messages_detail {

void register_rcl_types() {
  namespace msg = rcl_interfaces::msg;
  namespace srv = rcl_interfaces::srv;
  register_messages<msg::Log, msg::ParameterType, msg::ParameterValue, msg::Parameter,
                    msg::FloatingPointRange, msg::IntegerRange, msg::ParameterDescriptor,
                    msg::SetParametersResult, msg::ListParametersResult, msg::ParameterEvent>();
  register_services<srv::ListParameters, srv::GetParameters, srv::GetParameterTypes, srv::DescribeParameters,
                    srv::SetParameters, srv::SetParametersAtomically>();
  register_messages<unique_identifier_msgs::msg::UUID, action_msgs::msg::GoalInfo,
                    action_msgs::msg::GoalStatus, action_msgs::msg::GoalStatusArray>();
  register_services<action_msgs::srv::CancelGoal>();
  namespace type = type_description_interfaces::msg;
  register_messages<service_msgs::msg::ServiceEventInfo, type::FieldType, type::Field,
                    type::IndividualTypeDescription, type::TypeDescription, type::TypeSource,
                    type::KeyValue>();
  register_services<type_description_interfaces::srv::GetTypeDescription>();
}

}  // namespace doppel::messages_detail
