#pragma once
// ROS 2's six parameter services over a node's Parameters.

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel {

// Serves ~/list_parameters, ~/get_parameters, ~/get_parameter_types, ~/describe_parameters, ~/set_parameters
// and ~/set_parameters_atomically as long as the node exists.
DOPPEL_API void serve_parameters(Node& node);

DOPPEL_API rcl_interfaces::msg::ParameterValue to_msg(const ParameterValue& value);
// A byte array becomes an integer array; an unknown type becomes "not set".
DOPPEL_API ParameterValue from_msg(const rcl_interfaces::msg::ParameterValue& message);

}  // namespace doppel
