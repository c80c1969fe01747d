#pragma once
// How ROS 2 gets to what runs: the bridge to its network. On by default; without a usable network the twin
// keeps running.

#include <cstdint>
#include <optional>
#include <string>

#include "doppel/bus/ros_arguments.h"
#include "doppel/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/ros2/bridge.h"

namespace doppel {

struct RosEdgeOptions {
  bool none = false;                    // do not join
  std::optional<std::uint32_t> domain;  // else ROS_DOMAIN_ID
};

// What the options, --ros-args and ROS 2's environment variables make of it; nothing: not wanted. Throws
// InputError; to be called before anything starts.
DOPPEL_API std::optional<ros2::ParticipantOptions> ros_network(const RosEdgeOptions& options,
                                                               const RosArguments& ros,
                                                               Diagnostics& diagnostics);

class DOPPEL_API RosEdge {
 public:
  // `bus` and `log` have to outlive it.
  RosEdge(Bus& bus, std::optional<ros2::ParticipantOptions> network, const Log& log)
      : bus_(bus), log_(log), network_(std::move(network)) {}

  // A line about who can see it, for people; empty where it does not join.
  [[nodiscard]] std::string banner() const;
  // Joins the network, without waiting for it. The loop's thread.
  void open();
  [[nodiscard]] bool is_open() const { return bridge_.has_value(); }

 private:
  Bus& bus_;
  const Log& log_;
  std::optional<ros2::ParticipantOptions> network_;
  std::optional<ros2::Bridge> bridge_;
};

}  // namespace doppel
