#pragma once
// ROS 2's lifecycle_msgs: the state of a controller or a hardware component.

#include "doppel/messages/message.h"

namespace doppel::lifecycle_msgs::msg {

struct State {
  static constexpr std::uint8_t PRIMARY_STATE_UNKNOWN = 0, PRIMARY_STATE_UNCONFIGURED = 1,
                                PRIMARY_STATE_INACTIVE = 2, PRIMARY_STATE_ACTIVE = 3,
                                PRIMARY_STATE_FINALIZED = 4, TRANSITION_STATE_CONFIGURING = 10,
                                TRANSITION_STATE_CLEANINGUP = 11, TRANSITION_STATE_SHUTTINGDOWN = 12,
                                TRANSITION_STATE_ACTIVATING = 13, TRANSITION_STATE_DEACTIVATING = 14,
                                TRANSITION_STATE_ERRORPROCESSING = 15;
  std::uint8_t id = 0;
  std::string label;
  DOPPEL_MESSAGE("lifecycle_msgs/msg/State", id, label)
  DOPPEL_CONSTANTS(PRIMARY_STATE_UNKNOWN, PRIMARY_STATE_UNCONFIGURED, PRIMARY_STATE_INACTIVE,
                   PRIMARY_STATE_ACTIVE, PRIMARY_STATE_FINALIZED, TRANSITION_STATE_CONFIGURING,
                   TRANSITION_STATE_CLEANINGUP, TRANSITION_STATE_SHUTTINGDOWN, TRANSITION_STATE_ACTIVATING,
                   TRANSITION_STATE_DEACTIVATING, TRANSITION_STATE_ERRORPROCESSING)
};

}  // namespace doppel::lifecycle_msgs::msg
