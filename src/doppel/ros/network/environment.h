#pragma once
// ROS 2's environment variables for the network: ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE
// (doppel's default is LOCALHOST), ROS_LOCALHOST_ONLY (deprecated, has priority if it is set, as
// in rmw), ROS_STATIC_PEERS, and ROS_DISTRO.

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/ros/messages/distro.h"

namespace doppel::ros2 {

inline constexpr std::uint32_t kLastDomain = 232;  // with a larger one RTPS's ports exceed 65535

enum class DiscoveryRange { off, localhost, subnet, system_default };

struct ParticipantOptions {
  std::uint32_t domain = 0;  // 0 to kLastDomain
  DiscoveryRange range = DiscoveryRange::localhost;
  std::vector<std::string> static_peers;  // addresses or host names
  std::string enclave = "/";
  std::chrono::milliseconds lease{20000};  // after which peers drop a silent participant; Fast DDS's default
  // Called while the host names of static_peers are looked up, which may take long; may be empty.
  std::function<bool()> is_cancelled;
};

// Throws InputError for a value that ROS 2 rejects; deprecated or ignored values are diagnostics.
// `lookup` is getenv.
DOPPEL_API ParticipantOptions from_environment(const std::function<const char*(const char*)>& lookup,
                                               Diagnostics& diagnostics);

// The distribution of ROS_DISTRO; nullopt: it is not set, or is one whose messages are not here, which is a
// note. "rolling" is the newest one.
DOPPEL_API std::optional<Distro> distro_from_environment(
    const std::function<const char*(const char*)>& lookup, Diagnostics& diagnostics);

// Unsets FASTDDS_STATISTICS, because Fast DDS reads it itself, counts the samples that peers report to have
// sent, and ends the process if it finds the numbers impossible. Called before the first thread is started,
// because other threads may read the environment; no participant is made while the variable is set.
DOPPEL_API void forget_statistics();

// "localhost", "subnet": for banners.
DOPPEL_API std::string_view to_string(DiscoveryRange range);

}  // namespace doppel::ros2
