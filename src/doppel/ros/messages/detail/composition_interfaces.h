#pragma once
// ROS 2's composition_interfaces: loading nodes into a running container.

#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel::composition_interfaces::srv {

struct ListNodes {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("composition_interfaces/srv/ListNodes_Request")
  };
  struct Response {
    std::vector<std::string> full_node_names;
    std::vector<std::uint64_t> unique_ids;
    DOPPEL_MESSAGE("composition_interfaces/srv/ListNodes_Response", full_node_names, unique_ids)
  };
};

struct LoadNode {
  struct Request {
    std::string package_name, plugin_name, node_name, node_namespace;
    std::uint8_t log_level = 0;
    std::vector<std::string> remap_rules;
    std::vector<rcl_interfaces::msg::Parameter> parameters, extra_arguments;
    DOPPEL_MESSAGE("composition_interfaces/srv/LoadNode_Request", package_name, plugin_name, node_name,
                   node_namespace, log_level, remap_rules, parameters, extra_arguments)
  };
  struct Response {
    bool success = false;
    std::string error_message, full_node_name;
    std::uint64_t unique_id = 0;
    DOPPEL_MESSAGE("composition_interfaces/srv/LoadNode_Response", success, error_message, full_node_name,
                   unique_id)
  };
};

struct UnloadNode {
  struct Request {
    std::uint64_t unique_id = 0;
    DOPPEL_MESSAGE("composition_interfaces/srv/UnloadNode_Request", unique_id)
  };
  struct Response {
    bool success = false;
    std::string error_message;
    DOPPEL_MESSAGE("composition_interfaces/srv/UnloadNode_Response", success, error_message)
  };
};

}  // namespace doppel::composition_interfaces::srv
