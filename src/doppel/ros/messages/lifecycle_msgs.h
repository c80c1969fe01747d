#pragma once
// ROS 2's lifecycle_msgs: the state of a controller, a hardware component or a node, and how it changes.

#include "doppel/ros/messages/message.h"

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

struct Transition {
  static constexpr std::uint8_t TRANSITION_CREATE = 0, TRANSITION_CONFIGURE = 1, TRANSITION_CLEANUP = 2,
                                TRANSITION_ACTIVATE = 3, TRANSITION_DEACTIVATE = 4,
                                TRANSITION_UNCONFIGURED_SHUTDOWN = 5, TRANSITION_INACTIVE_SHUTDOWN = 6,
                                TRANSITION_ACTIVE_SHUTDOWN = 7, TRANSITION_DESTROY = 8,
                                TRANSITION_ON_CONFIGURE_SUCCESS = 10, TRANSITION_ON_CONFIGURE_FAILURE = 11,
                                TRANSITION_ON_CONFIGURE_ERROR = 12, TRANSITION_ON_CLEANUP_SUCCESS = 20,
                                TRANSITION_ON_CLEANUP_FAILURE = 21, TRANSITION_ON_CLEANUP_ERROR = 22,
                                TRANSITION_ON_ACTIVATE_SUCCESS = 30, TRANSITION_ON_ACTIVATE_FAILURE = 31,
                                TRANSITION_ON_ACTIVATE_ERROR = 32, TRANSITION_ON_DEACTIVATE_SUCCESS = 40,
                                TRANSITION_ON_DEACTIVATE_FAILURE = 41, TRANSITION_ON_DEACTIVATE_ERROR = 42,
                                TRANSITION_ON_SHUTDOWN_SUCCESS = 50, TRANSITION_ON_SHUTDOWN_FAILURE = 51,
                                TRANSITION_ON_SHUTDOWN_ERROR = 52, TRANSITION_ON_ERROR_SUCCESS = 60,
                                TRANSITION_ON_ERROR_FAILURE = 61, TRANSITION_ON_ERROR_ERROR = 62,
                                TRANSITION_CALLBACK_SUCCESS = 97, TRANSITION_CALLBACK_FAILURE = 98,
                                TRANSITION_CALLBACK_ERROR = 99;
  std::uint8_t id = 0;
  std::string label;
  DOPPEL_MESSAGE("lifecycle_msgs/msg/Transition", id, label)
  DOPPEL_CONSTANTS(TRANSITION_CREATE, TRANSITION_CONFIGURE, TRANSITION_CLEANUP, TRANSITION_ACTIVATE,
                   TRANSITION_DEACTIVATE, TRANSITION_UNCONFIGURED_SHUTDOWN, TRANSITION_INACTIVE_SHUTDOWN,
                   TRANSITION_ACTIVE_SHUTDOWN, TRANSITION_DESTROY, TRANSITION_ON_CONFIGURE_SUCCESS,
                   TRANSITION_ON_CONFIGURE_FAILURE, TRANSITION_ON_CONFIGURE_ERROR,
                   TRANSITION_ON_CLEANUP_SUCCESS, TRANSITION_ON_CLEANUP_FAILURE, TRANSITION_ON_CLEANUP_ERROR,
                   TRANSITION_ON_ACTIVATE_SUCCESS, TRANSITION_ON_ACTIVATE_FAILURE,
                   TRANSITION_ON_ACTIVATE_ERROR, TRANSITION_ON_DEACTIVATE_SUCCESS,
                   TRANSITION_ON_DEACTIVATE_FAILURE, TRANSITION_ON_DEACTIVATE_ERROR,
                   TRANSITION_ON_SHUTDOWN_SUCCESS, TRANSITION_ON_SHUTDOWN_FAILURE,
                   TRANSITION_ON_SHUTDOWN_ERROR, TRANSITION_ON_ERROR_SUCCESS, TRANSITION_ON_ERROR_FAILURE,
                   TRANSITION_ON_ERROR_ERROR, TRANSITION_CALLBACK_SUCCESS, TRANSITION_CALLBACK_FAILURE,
                   TRANSITION_CALLBACK_ERROR)
};

struct TransitionDescription {
  Transition transition;
  State start_state, goal_state;
  DOPPEL_MESSAGE("lifecycle_msgs/msg/TransitionDescription", transition, start_state, goal_state)
};

struct TransitionEvent {
  std::uint64_t timestamp = 0;  // ns
  Transition transition;
  State start_state, goal_state;
  DOPPEL_MESSAGE("lifecycle_msgs/msg/TransitionEvent", timestamp, transition, start_state, goal_state)
};

}  // namespace doppel::lifecycle_msgs::msg

namespace doppel::lifecycle_msgs::srv {

struct ChangeState {
  struct Request {
    msg::Transition transition;
    DOPPEL_MESSAGE("lifecycle_msgs/srv/ChangeState_Request", transition)
  };
  struct Response {
    bool success = false;
    DOPPEL_MESSAGE("lifecycle_msgs/srv/ChangeState_Response", success)
  };
};

struct GetAvailableStates {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("lifecycle_msgs/srv/GetAvailableStates_Request")
  };
  struct Response {
    std::vector<msg::State> available_states;
    DOPPEL_MESSAGE("lifecycle_msgs/srv/GetAvailableStates_Response", available_states)
  };
};

struct GetAvailableTransitions {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("lifecycle_msgs/srv/GetAvailableTransitions_Request")
  };
  struct Response {
    std::vector<msg::TransitionDescription> available_transitions;
    DOPPEL_MESSAGE("lifecycle_msgs/srv/GetAvailableTransitions_Response", available_transitions)
  };
};

struct GetState {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("lifecycle_msgs/srv/GetState_Request")
  };
  struct Response {
    msg::State current_state;
    DOPPEL_MESSAGE("lifecycle_msgs/srv/GetState_Response", current_state)
  };
};

}  // namespace doppel::lifecycle_msgs::srv
