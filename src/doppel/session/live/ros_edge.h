#pragma once
// The bridge to the ROS 2 network. On by default; without a usable network the twin keeps running.

#include <cstdint>
#include <optional>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/ros/bus/ros_arguments.h"
#include "doppel/ros/network/bridge.h"

namespace doppel {

struct RosEdgeOptions {
  bool none = false;                    // do not join
  std::optional<std::uint32_t> domain;  // else ROS_DOMAIN_ID
  ros2::Yielding move_group = ros2::Yielding::to_others;
};

// The participant's options from the arguments, --ros-args and ROS 2's environment variables; nullopt:
// disabled. Throws InputError; called before anything starts.
DOPPEL_API std::optional<ros2::ParticipantOptions> ros_network(const RosEdgeOptions& options,
                                                               const RosArguments& ros,
                                                               Diagnostics& diagnostics);

class DOPPEL_API RosEdge {
 public:
  // `bus` and `log` outlive the edge.
  RosEdge(Bus& bus, std::optional<ros2::ParticipantOptions> network, ros2::Yielding move_group,
          const Log& log)
      : bus_(bus), log_(log), network_(std::move(network)), move_group_(move_group) {}

  // A line for the terminal about its visibility; empty if it does not join.
  [[nodiscard]] std::string banner() const;
  // Joins the network, without waiting for it. The loop's thread.
  void open();
  [[nodiscard]] bool is_open() const { return bridge_.has_value(); }

 private:
  Bus& bus_;
  const Log& log_;
  std::optional<ros2::ParticipantOptions> network_;
  const ros2::Yielding move_group_;
  std::optional<ros2::Bridge> bridge_;
};

}  // namespace doppel
