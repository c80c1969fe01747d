#pragma once
// ros2_control's controller_manager_msgs, as in Jazzy.

#include "doppel/ros/messages/lifecycle_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::controller_manager_msgs::msg {

struct ChainConnection {
  std::string name;
  std::vector<std::string> reference_interfaces;
  DOPPEL_MESSAGE("controller_manager_msgs/msg/ChainConnection", name, reference_interfaces)
};

struct ControllerState {
  std::string name;
  std::string state;  // "unconfigured", "inactive", "active" or "finalized"
  std::string type;
  bool is_async = false;
  std::uint16_t update_rate = 0;  // Hz
  std::vector<std::string> claimed_interfaces, required_command_interfaces, required_state_interfaces;
  bool is_chainable = false, is_chained = false;
  std::vector<std::string> exported_state_interfaces, reference_interfaces;
  std::vector<ChainConnection> chain_connections;
  DOPPEL_MESSAGE("controller_manager_msgs/msg/ControllerState", name, state, type, is_async, update_rate,
                 claimed_interfaces, required_command_interfaces, required_state_interfaces, is_chainable,
                 is_chained, exported_state_interfaces, reference_interfaces, chain_connections)
};

struct HardwareInterface {
  std::string name;
  std::string data_type;
  bool is_available = false, is_claimed = false;
  DOPPEL_MESSAGE("controller_manager_msgs/msg/HardwareInterface", name, data_type, is_available, is_claimed)
};

struct HardwareComponentState {
  std::string name;
  std::string type;
  bool is_async = false;
  std::uint16_t rw_rate = 0;  // Hz
  std::string class_type;     // deprecated in Jazzy, still on its wire
  std::string plugin_name;
  lifecycle_msgs::msg::State state;
  std::vector<HardwareInterface> command_interfaces, state_interfaces;
  DOPPEL_MESSAGE("controller_manager_msgs/msg/HardwareComponentState", name, type, is_async, rw_rate,
                 class_type, plugin_name, state, command_interfaces, state_interfaces)
};

struct NamedLifecycleState {
  std::string name;
  lifecycle_msgs::msg::State state;
  DOPPEL_MESSAGE("controller_manager_msgs/msg/NamedLifecycleState", name, state)
};

struct ControllerManagerActivity {
  std_msgs::msg::Header header;
  std::vector<NamedLifecycleState> controllers, hardware_components;
  DOPPEL_MESSAGE("controller_manager_msgs/msg/ControllerManagerActivity", header, controllers,
                 hardware_components)
};

}  // namespace doppel::controller_manager_msgs::msg

namespace doppel::controller_manager_msgs::srv {

struct ListControllers {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("controller_manager_msgs/srv/ListControllers_Request")
  };
  struct Response {
    std::vector<msg::ControllerState> controller;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/ListControllers_Response", controller)
  };
};

struct ListControllerTypes {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("controller_manager_msgs/srv/ListControllerTypes_Request")
  };
  struct Response {
    std::vector<std::string> types, base_classes;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/ListControllerTypes_Response", types, base_classes)
  };
};

struct ListHardwareInterfaces {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("controller_manager_msgs/srv/ListHardwareInterfaces_Request")
  };
  struct Response {
    std::vector<msg::HardwareInterface> command_interfaces, state_interfaces;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/ListHardwareInterfaces_Response", command_interfaces,
                   state_interfaces)
  };
};

struct ListHardwareComponents {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("controller_manager_msgs/srv/ListHardwareComponents_Request")
  };
  struct Response {
    std::vector<msg::HardwareComponentState> component;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/ListHardwareComponents_Response", component)
  };
};

struct LoadController {
  struct Request {
    std::string name;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/LoadController_Request", name)
  };
  struct Response {
    bool ok = false;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/LoadController_Response", ok)
  };
};

struct ConfigureController {
  struct Request {
    std::string name;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/ConfigureController_Request", name)
  };
  struct Response {
    bool ok = false;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/ConfigureController_Response", ok)
  };
};

struct CleanupController {
  struct Request {
    std::string name;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/CleanupController_Request", name)
  };
  struct Response {
    bool ok = false;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/CleanupController_Response", ok)
  };
};

struct UnloadController {
  struct Request {
    std::string name;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/UnloadController_Request", name)
  };
  struct Response {
    bool ok = false;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/UnloadController_Response", ok)
  };
};

struct SwitchController {
  struct Request {
    static constexpr std::int32_t BEST_EFFORT = 1, STRICT = 2, AUTO = 3, FORCE_AUTO = 4;
    std::vector<std::string> activate_controllers, deactivate_controllers;
    std::int32_t strictness = 0;
    bool activate_asap = false;
    builtin_interfaces::msg::Duration timeout;  // zero: no limit
    DOPPEL_MESSAGE("controller_manager_msgs/srv/SwitchController_Request", activate_controllers,
                   deactivate_controllers, strictness, activate_asap, timeout)
    DOPPEL_CONSTANTS(BEST_EFFORT, STRICT, AUTO, FORCE_AUTO)
  };
  struct Response {
    bool ok = false;
    std::string message;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/SwitchController_Response", ok, message)
  };
};

struct SetHardwareComponentState {
  struct Request {
    std::string name;
    lifecycle_msgs::msg::State target_state;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/SetHardwareComponentState_Request", name, target_state)
  };
  struct Response {
    bool ok = false;
    lifecycle_msgs::msg::State state;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/SetHardwareComponentState_Response", ok, state)
  };
};

struct ReloadControllerLibraries {
  struct Request {
    bool force_kill = false;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/ReloadControllerLibraries_Request", force_kill)
  };
  struct Response {
    bool ok = false;
    DOPPEL_MESSAGE("controller_manager_msgs/srv/ReloadControllerLibraries_Response", ok)
  };
};

}  // namespace doppel::controller_manager_msgs::srv
