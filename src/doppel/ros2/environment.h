#pragma once
// What ROS 2's environment variables say of the network: ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE
// (doppel's default is LOCALHOST), ROS_LOCALHOST_ONLY (deprecated, wins where it is set, as in rmw),
// ROS_STATIC_PEERS.

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/export.h"

namespace doppel::ros2 {

inline constexpr std::uint32_t kLastDomain = 232;  // beyond it RTPS has no ports left

enum class DiscoveryRange { off, localhost, subnet, system_default };

struct ParticipantOptions {
  std::uint32_t domain = 0;  // 0 to kLastDomain
  DiscoveryRange range = DiscoveryRange::localhost;
  std::vector<std::string> static_peers;  // addresses or host names
  std::string enclave = "/";
  std::chrono::milliseconds lease{20000};  // after which a silent peer drops us; Fast DDS' default
  // Asked while the hosts among static_peers are looked up, which may take long; may be empty.
  std::function<bool()> is_cancelled;
};

// Throws InputError for a value that ROS 2 would refuse; what is deprecated or ignored becomes a diagnostic.
// `lookup` is getenv.
DOPPEL_API ParticipantOptions from_environment(const std::function<const char*(const char*)>& lookup,
                                               Diagnostics& diagnostics);

// Fast DDS reads FASTDDS_STATISTICS itself, and would count what peers say that they have sent and end the
// process where it finds that impossible: unsets it. Before the first thread is started, for other threads
// may read the environment; a participant is refused while the variable is set.
DOPPEL_API void forget_statistics();

// "localhost", "subnet": for banners.
DOPPEL_API std::string_view to_string(DiscoveryRange range);

}  // namespace doppel::ros2
