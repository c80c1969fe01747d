#pragma once
// Private to the bridge: the status of the network on /diagnostics (diagnostic_msgs/msg/DiagnosticArray).

#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/network/bridge.h"

namespace doppel::ros2 {

class NetworkDiagnostics {
 public:
  // The loop's thread, as its end.
  NetworkDiagnostics(Bus& bus, const BridgeOptions& options);
  // Any thread: published by the loop, if there are subscribers.
  void publish(const NetworkStatus& status);

 private:
  Bus& bus_;
  const ParticipantOptions network_;
  doppel::Node node_;  // of the bus
  doppel::Publisher<diagnostic_msgs::msg::DiagnosticArray> topic_;
  std::uint64_t refused_published_ = 0;
};

}  // namespace doppel::ros2
