#pragma once
// The parameter service_introspection of /gazebo: what the twin's services publish of their calls, on hidden
// topics <service>/_service_event, for `service echo` and `action echo`. rclcpp's nodes have no such
// parameter of their own; its values are those of ROS 2's demos: disabled, metadata, contents.

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/ros_arguments.h"

namespace doppel {

// `node` is one with parameter services; it outlives the bus's use of them. Throws InputError if the command
// line has another value.
void declare_introspection(Node& node, const RosArguments& arguments);

}  // namespace doppel
