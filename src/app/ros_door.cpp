#include "app/ros_door.h"

#include <fmt/format.h>

#include <cstdlib>

#include "app/tell.h"
#include "app/verbs/description_target.h"

namespace doppel::app {
namespace {

std::string who_can_see(const ros2::ParticipantOptions& network) {
  switch (network.range) {
    case ros2::DiscoveryRange::off:
      return "nobody is discovered (ROS_AUTOMATIC_DISCOVERY_RANGE=OFF)";
    case ros2::DiscoveryRange::localhost:
      return network.static_peers.empty()
                 ? "this machine only (ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET opens it)"
                 : fmt::format("this machine and {}", fmt::join(network.static_peers, ", "));
    case ros2::DiscoveryRange::subnet:
    case ros2::DiscoveryRange::system_default:
      return "the whole local network";
  }
  return "";
}

}  // namespace

void add_ros_door_options(CLI::App& verb, RosDoorOptions& options) {
  CLI::Option* none = verb.add_flag("--no-ros", options.none, "Do not join ROS 2's network");
  verb.add_option("--domain", options.domain, "ROS 2's domain (else ROS_DOMAIN_ID, else 0)")
      ->check(CLI::Range(std::uint32_t{0}, ros2::kLastDomain))
      ->excludes(none);
}

std::optional<ros2::ParticipantOptions> ros_network(const RosDoorOptions& options, const RosArguments& ros) {
  if (options.none) return std::nullopt;
  Diagnostics diagnostics;
  auto network = ros2::from_environment(
      [&options](const char* name) -> const char* {
        const bool overridden = options.domain.has_value() && std::string_view(name) == "ROS_DOMAIN_ID";
        return overridden ? nullptr : std::getenv(name);
      },
      diagnostics);
  print_diagnostics(diagnostics, true);
  if (options.domain.has_value()) network.domain = *options.domain;
  if (ros.enclave.has_value()) network.enclave = *ros.enclave;
  return network;
}

void RosDoor::print() const {
  if (network_.has_value()) tell("  ros 2        domain {}, {}\n", network_->domain, who_can_see(*network_));
}

void RosDoor::open() {
  if (network_.has_value())
    bridge_.emplace(bus_, ros2::BridgeOptions{.network = *network_, .diagnostics_node = "/doppel"}, log_);
}

}  // namespace doppel::app
