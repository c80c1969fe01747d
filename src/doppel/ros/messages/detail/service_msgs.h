#pragma once
// ROS 2's service_msgs: the common part of the event messages that rosidl derives from services.

#include "doppel/ros/messages/builtin_interfaces.h"

namespace doppel::service_msgs::msg {

struct ServiceEventInfo {
  static constexpr std::uint8_t REQUEST_SENT = 0, REQUEST_RECEIVED = 1, RESPONSE_SENT = 2,
                                RESPONSE_RECEIVED = 3;
  std::uint8_t event_type = REQUEST_SENT;
  builtin_interfaces::msg::Time stamp;
  std::array<std::uint8_t, 16> client_gid{};
  std::int64_t sequence_number = 0;
  DOPPEL_MESSAGE("service_msgs/msg/ServiceEventInfo", event_type, stamp, client_gid, sequence_number)
  DOPPEL_CONSTANTS(REQUEST_SENT, REQUEST_RECEIVED, RESPONSE_SENT, RESPONSE_RECEIVED)
};

}  // namespace doppel::service_msgs::msg
