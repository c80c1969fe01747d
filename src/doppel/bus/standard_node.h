#pragma once
// What every node of ROS 2 has, whatever it does (rclcpp::Node): the six parameter services,
// ~/get_type_description, /parameter_events, /rosout, and the parameters that all of them have.

#include <string_view>

#include "doppel/bus/bus.h"
#include "doppel/export.h"

namespace doppel {

// Call it before the node declares parameters of its own, so that these are reported on /parameter_events.
// Declares use_sim_time (the bus's, not to be changed), start_type_description_service and
// qos_overrides./parameter_events; subscribes to what rclcpp's nodes subscribe to, so that graphs look alike.
// own_clock: the node declares use_sim_time and hears /clock by itself.
DOPPEL_API void make_standard(Node& node, bool own_clock = false);

// ~/get_logger_levels and ~/set_logger_levels, which act on what reaches /rosout (rosout.h).
DOPPEL_API void serve_logger_levels(Node& node);

// The read-only parameters "qos_overrides./topic.publisher.depth" and so on of a topic whose QoS ROS 2's node
// would let the user override. Which policies differs by node: rclcpp's default ones leave durability out.
enum class QosOverrideOf { publisher, subscription };
enum class QosOverridePolicies { all, without_durability };
DOPPEL_API void declare_qos_overrides(Node& node, std::string_view topic, QosOverrideOf end, const Qos& qos,
                                      QosOverridePolicies policies = QosOverridePolicies::all);

}  // namespace doppel
