#pragma once
// How ROS 2 gets to what runs: the bridge to its network, its options on the command line and its line in the
// banner. On by default; without a usable network the twin runs on.

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "doppel/bus/ros_arguments.h"
#include "doppel/ros2/bridge.h"

namespace doppel::app {

struct RosDoorOptions {
  bool none = false;
  std::optional<std::uint32_t> domain;  // else ROS_DOMAIN_ID
};

// --no-ros and --domain.
void add_ros_door_options(CLI::App& verb, RosDoorOptions& options);

// What the options, --ros-args and ROS 2's environment variables make of it; nothing: not wanted. Throws
// InputError; to be called before anything starts.
std::optional<ros2::ParticipantOptions> ros_network(const RosDoorOptions& options, const RosArguments& ros);

class RosDoor {
 public:
  // `bus` and `log` have to outlive it.
  RosDoor(Bus& bus, std::optional<ros2::ParticipantOptions> network, const Log& log)
      : bus_(bus), log_(log), network_(std::move(network)) {}

  // The banner's line, to stderr.
  void print() const;
  // Joins the network, without waiting for it. The loop's thread.
  void open();

 private:
  Bus& bus_;
  const Log& log_;
  std::optional<ros2::ParticipantOptions> network_;
  std::optional<ros2::Bridge> bridge_;
};

}  // namespace doppel::app
