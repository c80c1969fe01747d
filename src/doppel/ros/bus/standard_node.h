#pragma once
// The interfaces of every node of ROS 2 (rclcpp::Node): the six parameter services, ~/get_type_description,
// /parameter_events, /rosout, and the standard parameters.

#include <string_view>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"

namespace doppel {

// Called before the node declares its own parameters, so that these are published on /parameter_events.
// Declares use_sim_time (read-only, as set for the bus), start_type_description_service and
// qos_overrides./parameter_events; subscribes to the same topics as rclcpp's nodes, so that graphs are equal.
// own_clock: the node declares use_sim_time and subscribes to /clock itself.
DOPPEL_API void make_standard(Node& node, bool own_clock = false);

// ~/get_logger_levels and ~/set_logger_levels, which control the lines on /rosout (rosout.h).
DOPPEL_API void serve_logger_levels(Node& node);

// The read-only parameters "qos_overrides./topic.publisher.depth" and so on of a topic whose QoS
// can be overridden in ROS 2's node. The policies depend on the node: rclcpp's default set does
// not include durability.
enum class QosOverrideOf { publisher, subscription };
enum class QosOverridePolicies { all, without_durability };
DOPPEL_API void declare_qos_overrides(Node& node, std::string_view topic, QosOverrideOf end, const Qos& qos,
                                      QosOverridePolicies policies = QosOverridePolicies::all);

}  // namespace doppel
