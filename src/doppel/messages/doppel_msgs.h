#pragma once
// Messages without a counterpart in ROS 2: the status of the twin's loop, and the state of
// the whole simulation.

#include "doppel/messages/std_msgs.h"

namespace doppel::doppel_msgs::msg {

struct TwinStatus {
  double sim_time = 0;          // s
  double wall_time = 0;         // s of wall-clock time since the start of the run
  std::uint64_t steps = 0;      // since the start; a reset does not set them back
  double real_time_factor = 0;  // over the last half second; 0 while paused
  bool paused = false;
  double speed = 0;                                             // requested factor; 0: as fast as possible
  double lateness_p50 = 0, lateness_p99 = 0, lateness_max = 0;  // s, of steps relative to wall-clock time
  // Wall-clock time per step by activity, mean over the last half second, microseconds; 0 while paused.
  // control: hardware and controllers, including their publishing; physics: the engine's step; publish: /tf
  // and /clock; bus: between steps (services, received messages, reports); idle: sleeping until the next
  // step is due.
  double time_control = 0, time_physics = 0, time_publish = 0, time_bus = 0, time_idle = 0;
  std::uint64_t overruns = 0;  // how often the loop was 100 ms late and its schedule was moved
  std::uint64_t skipped = 0;   // messages that were skipped for slow clients
  DOPPEL_MESSAGE("doppel_msgs/msg/TwinStatus", sim_time, wall_time, steps, real_time_factor, paused, speed,
                 lateness_p50, lateness_p99, lateness_max, time_control, time_physics, time_publish, time_bus,
                 time_idle, overruns, skipped)
};

// The load of each driven joint; N m or N. One element of each list per joint.
struct JointLoads {
  std_msgs::msg::Header header;
  std::vector<std::string> joint_names;
  std::vector<double> efforts;          // of the drives in the last step
  std::vector<double> gravity_torques;  // load of gravity on the drives at rest in this pose
  std::vector<double> sags;             // rad or m: offset of the joint from its target by gravity
  std::vector<double> margins;          // effort limit - |gravity torque|; negative: cannot hold
  std::vector<double> effort_limits;    // infinite: none
  std::vector<double> frictions;        // the most that Coulomb friction can hold
  std::vector<double>
      least_sags;                 // sag less and plus friction / stiffness: the joint rests anywhere between;
  std::vector<double> most_sags;  // all three are 0 where it rests on its limit
  DOPPEL_MESSAGE("doppel_msgs/msg/JointLoads", header, joint_names, efforts, gravity_torques, sags, margins,
                 effort_limits, frictions, least_sags, most_sags)
};

// A sensor of light of a twin.
struct Sensor {
  std::string name;                 // "kate/camera_link/camera": robot, link, sensor
  std::string type;                 // "gpu_lidar", as described
  std::vector<std::string> topics;  // the first is that of its data
  std::string frame;                // of its headers
  double rate = 0;                  // Hz that are asked for; 0: every step
  double reached = 0;               // Hz of simulated time over the last second; 0: nobody reads
  std::uint64_t samples = 0;        // made so far
  std::uint64_t left_out = 0;       // because they took too long
  double cost = 0;                  // s of processor time of the last sample
  DOPPEL_MESSAGE("doppel_msgs/msg/Sensor", name, type, topics, frame, rate, reached, samples, left_out, cost)
};

struct Sensors {
  std::vector<Sensor> sensors;
  DOPPEL_MESSAGE("doppel_msgs/msg/Sensors", sensors)
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
