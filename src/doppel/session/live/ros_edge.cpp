#include "doppel/session/live/ros_edge.h"

#include <fmt/format.h>

#include <cstdlib>
#include <string_view>

#include "doppel/ros/network/middleware.h"
#include "doppel/ros/network/participant.h"
#include "doppel/ros/server/announcement.h"

namespace doppel {
namespace {

std::string who_can_see(const ros2::ParticipantOptions& network) {
  switch (network.range) {
    case ros2::DiscoveryRange::off:
      return "discovery is off (ROS_AUTOMATIC_DISCOVERY_RANGE=OFF)";
    case ros2::DiscoveryRange::localhost:
      return network.static_peers.empty()
                 ? "this machine only (ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET opens it)"
                 : fmt::format("this machine and {}", fmt::join(network.static_peers, ", "));
    case ros2::DiscoveryRange::subnet:
    case ros2::DiscoveryRange::system_default:
      return "the whole local network, where everyone can command the twin (doppel man security.md)";
  }
  return "";
}

std::string name_of_twin(int process) {
  for (const RunningTwin& twin : find_running()) {
    if (twin.pid == process) return "the twin " + twin.label();
  }
  return "";
}

}  // namespace

std::optional<ros2::ParticipantOptions> ros_network(const RosEdgeOptions& options, const RosArguments& ros,
                                                    Diagnostics& diagnostics) {
  if (options.none) return std::nullopt;
  auto network = ros2::from_environment(
      [&options](const char* name) -> const char* {
        const bool overridden = options.domain.has_value() && std::string_view(name) == "ROS_DOMAIN_ID";
        return overridden ? nullptr : std::getenv(name);
      },
      diagnostics);
  if (options.domain.has_value()) network.domain = *options.domain;
  if (ros.enclave.has_value()) network.enclave = *ros.enclave;
  return network;
}

std::string RosEdge::banner() const {
  if (!network_.has_value()) return "";
  std::string lines = fmt::format("  ros 2        {}, domain {}, {}\n", title(ros_distro()).substr(6),
                                  network_->domain, who_can_see(*network_));
  const bool is_open = network_->range == ros2::DiscoveryRange::subnet ||
                       network_->range == ros2::DiscoveryRange::system_default;
  try {
    if (is_open)
      lines += fmt::format("               {}\n", ros2::describe_middleware(ros2::fast_dds_version()));
  } catch (const ros2::NetworkError&) {
    // Reported when the edge opens.
  }
  return lines;
}

void RosEdge::open() {
  if (!network_.has_value()) return;
  bridge_.emplace(bus_,
                  ros2::BridgeOptions{.network = *network_,
                                      .yielding = move_group_,
                                      .diagnostics_node = "/doppel",
                                      .name_process = name_of_twin},
                  log_);
}

}  // namespace doppel
