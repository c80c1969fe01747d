#pragma once
// Functions that the verbs of `doppel sensor` share.

#include "app/verbs/shell.h"
#include "doppel/ros/messages/doppel_msgs.h"

namespace doppel::app {

inline constexpr const char* kSensorList = "/doppel/sensors";  // a topic

// The sensors of the twin; empty if it has none. Throws ClientError if the twin does not list them.
doppel_msgs::msg::Sensors sensors_of(Client& twin);

struct SensorCheckOptions {
  double wait = 5;  // s of wall-clock time for each sensor, also where its period is shorter
  bool json = false;
};
// Reads a message of every topic of every sensor and prints what it contains. Returns 1 if a topic is silent, or names a
// frame that is not in TF.
int check_sensors(Shell& shell, const SensorCheckOptions& options);

}  // namespace doppel::app
