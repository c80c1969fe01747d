#include "doppel/ros/network/fastdds/fast_ports.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {
namespace {

constexpr std::uint32_t kBase = 7400, kPerDomain = 250, kPerParticipant = 2;
constexpr std::uint32_t kDiscoveryOffset = 10, kDataOffset = 11;
constexpr std::uint32_t kMaxParticipantsOfDomain = 120;  // after them the next domain's ports begin

constexpr const char* kAnyAddress = "0.0.0.0";

// errno of an attempt to bind, 0 for success; the port is free again afterwards.
int try_port(const std::string& address, std::uint32_t port) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return errno;
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(static_cast<std::uint16_t>(port));
  ::inet_pton(AF_INET, address.c_str(), &where.sin_addr);
  const int error = ::bind(fd, reinterpret_cast<const sockaddr*>(&where), sizeof where) == 0 ? 0 : errno;
  ::close(fd);
  return error;
}

bool is_up(const ifaddrs& interface, bool must_be_loopback) {
  const bool has_address = interface.ifa_addr != nullptr && interface.ifa_addr->sa_family == AF_INET;
  const bool is_loopback = (interface.ifa_flags & IFF_LOOPBACK) != 0;
  return has_address && (interface.ifa_flags & IFF_UP) != 0 && (is_loopback || !must_be_loopback);
}

// Sockets can be bound without an interface, but would never receive anything.
void check_interfaces(bool must_be_loopback) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return;
  bool found = false;
  for (const ifaddrs* i = all; i != nullptr && !found; i = i->ifa_next) found = is_up(*i, must_be_loopback);
  ::freeifaddrs(all);
  if (!found)
    throw NetworkError(
        must_be_loopback
            ? "no connection to ROS 2 nodes is possible: the loopback interface is down; ip link set lo up"
            : "no connection to ROS 2 nodes is possible: no network interface has an IPv4 address and is up");
}

}  // namespace

Ports free_ports(std::uint32_t domain, const std::string& address) {
  check_interfaces(address != kAnyAddress);
  const std::uint32_t base = kBase + kPerDomain * domain;
  for (std::uint32_t i = 0; i < kMaxParticipantsOfDomain; ++i) {
    const std::uint32_t discovery = base + kDiscoveryOffset + kPerParticipant * i;
    const std::uint32_t data = base + kDataOffset + kPerParticipant * i;
    if (data > 65535) break;
    int error = try_port(address, discovery);
    if (error == 0) error = try_port(address, data);
    if (error == 0)
      return {static_cast<std::uint16_t>(base), static_cast<std::uint16_t>(discovery),
              static_cast<std::uint16_t>(data)};
    if (error != EADDRINUSE && error != EACCES)
      throw NetworkError("no connection to ROS 2 nodes is possible: no socket can be opened at " + address +
                         " (" + std::strerror(error) + ")");
  }
  throw NetworkError("no connection to ROS 2 nodes is possible: all UDP ports of domain " +
                     std::to_string(domain) + " are taken at " + address + " (from " +
                     std::to_string(base + kDiscoveryOffset) +
                     "); end some participants or choose another ROS_DOMAIN_ID");
}

}  // namespace doppel::ros2::fast
