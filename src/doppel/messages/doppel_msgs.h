#pragma once
// What ROS 2 has no message for: how the twin's clock runs, and the state of the simulation as a whole.

#include "doppel/messages/std_msgs.h"

namespace doppel::doppel_msgs::msg {

struct TwinStatus {
  double sim_time = 0;   // s
  double wall_time = 0;  // s since the run began
  std::uint64_t steps = 0;
  double real_time_factor = 0;  // over the last second
  bool paused = false;
  double speed = 0;                                             // wanted factor; 0: as fast as possible
  double lateness_p50 = 0, lateness_p99 = 0, lateness_max = 0;  // s, of steps against the wall clock
  DOPPEL_MESSAGE("doppel_msgs/msg/TwinStatus", sim_time, wall_time, steps, real_time_factor, paused, speed,
                 lateness_p50, lateness_p99, lateness_max)
};

}  // namespace doppel::doppel_msgs::msg

namespace doppel::doppel_msgs::srv {

struct Step {
  struct Request {
    std::uint32_t steps = 1;
    DOPPEL_MESSAGE("doppel_msgs/srv/Step_Request", steps)
  };
  struct Response {
    bool success = false;
    std::string message;
    double sim_time = 0;  // s, after the steps
    DOPPEL_MESSAGE("doppel_msgs/srv/Step_Response", success, message, sim_time)
  };
};

struct SetSpeed {
  struct Request {
    double factor = 1;  // of real time; 0: as fast as possible
    DOPPEL_MESSAGE("doppel_msgs/srv/SetSpeed_Request", factor)
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("doppel_msgs/srv/SetSpeed_Response", success, message)
  };
};

// rad or m, rad/s or m/s, N m or N
struct GetState {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("doppel_msgs/srv/GetState_Request")
  };
  struct Response {
    double sim_time = 0;  // s
    std::vector<std::string> names;
    std::vector<double> positions, velocities, efforts;
    DOPPEL_MESSAGE("doppel_msgs/srv/GetState_Response", sim_time, names, positions, velocities, efforts)
  };
};

struct SetState {
  struct Request {
    std::vector<std::string> names;
    std::vector<double> positions;
    std::vector<double> velocities;  // empty: at rest
    DOPPEL_MESSAGE("doppel_msgs/srv/SetState_Request", names, positions, velocities)
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("doppel_msgs/srv/SetState_Response", success, message)
  };
};

}  // namespace doppel::doppel_msgs::srv
