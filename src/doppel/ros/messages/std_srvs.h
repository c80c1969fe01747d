#pragma once
// ROS 2's std_srvs: services without specific data.

#include "doppel/ros/messages/message.h"

namespace doppel::std_srvs::srv {

struct Empty {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("std_srvs/srv/Empty_Request")
  };
  struct Response {
    DOPPEL_EMPTY_MESSAGE("std_srvs/srv/Empty_Response")
  };
};

struct Trigger {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("std_srvs/srv/Trigger_Request")
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("std_srvs/srv/Trigger_Response", success, message)
  };
};

struct SetBool {
  struct Request {
    bool data = false;
    DOPPEL_MESSAGE("std_srvs/srv/SetBool_Request", data)
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("std_srvs/srv/SetBool_Response", success, message)
  };
};

}  // namespace doppel::std_srvs::srv
