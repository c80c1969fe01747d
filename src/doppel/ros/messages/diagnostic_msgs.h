#pragma once
// ROS 2's diagnostic_msgs: the status of parts of a machine.

#include "doppel/ros/messages/std_msgs.h"

namespace doppel::diagnostic_msgs::msg {

struct KeyValue {
  std::string key, value;
  DOPPEL_MESSAGE("diagnostic_msgs/msg/KeyValue", key, value)
};

struct DiagnosticStatus {
  static constexpr std::byte OK{0}, WARN{1}, ERROR{2}, STALE{3};
  std::byte level = OK;
  std::string name;  // "doppel: loop"
  std::string message;
  std::string hardware_id;
  std::vector<KeyValue> values;
  DOPPEL_MESSAGE("diagnostic_msgs/msg/DiagnosticStatus", level, name, message, hardware_id, values)
  DOPPEL_CONSTANTS(OK, WARN, ERROR, STALE)
};

struct DiagnosticArray {
  std_msgs::msg::Header header;
  std::vector<DiagnosticStatus> status;
  DOPPEL_MESSAGE("diagnostic_msgs/msg/DiagnosticArray", header, status)
};

}  // namespace doppel::diagnostic_msgs::msg

namespace doppel::diagnostic_msgs::srv {

struct AddDiagnostics {
  struct Request {
    std::string load_namespace;
    DOPPEL_MESSAGE("diagnostic_msgs/srv/AddDiagnostics_Request", load_namespace)
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("diagnostic_msgs/srv/AddDiagnostics_Response", success, message)
  };
};

struct SelfTest {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("diagnostic_msgs/srv/SelfTest_Request")
  };
  struct Response {
    std::string id;
    std::byte passed{};
    std::vector<msg::DiagnosticStatus> status;
    DOPPEL_MESSAGE("diagnostic_msgs/srv/SelfTest_Response", id, passed, status)
  };
};

}  // namespace doppel::diagnostic_msgs::srv
