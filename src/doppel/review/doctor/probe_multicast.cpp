// A datagram of our own to 239.255.0.1 and back. It is an RTPS message without content, so that the
// participants that get it as well ignore it; its time to live of zero keeps it on this machine.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/review/doctor/detail/probes.h"

namespace doppel::doctor {
namespace {

using Clock = std::chrono::steady_clock;
using Header = std::array<std::uint8_t, 20>;  // of RTPS: magic, version, vendor, GUID prefix

constexpr const char* kGroup = "239.255.0.1";
constexpr std::chrono::milliseconds kReplyTimeout{300};

std::string failure(const std::string& what) {
  return fmt::format("{}: {}", what, std::strerror(errno));
}

Header make_header() {
  Header header{'R', 'T', 'P', 'S', 2, 1, 0xFF, 0xFF};
  if (getrandom(header.data() + 8, 12, 0) != 12) header[8] = static_cast<std::uint8_t>(getpid());
  return header;
}

template <class Value>
bool set_option(int socket, int level, int option, const Value& value) {
  return setsockopt(socket, level, option, &value, sizeof value) == 0;
}

sockaddr_in address_of(const char* text, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  inet_pton(AF_INET, text, &address.sin_addr);
  return address;
}

// Others' datagrams come as well, and are passed over.
bool comes_back(int socket, const Header& sent) {
  const auto deadline = Clock::now() + kReplyTimeout;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd waited{socket, POLLIN, 0};
    if (left <= 0 || poll(&waited, 1, static_cast<int>(left)) <= 0) return false;
    Header got{};
    const ssize_t size = recv(socket, got.data(), got.size(), MSG_DONTWAIT);
    if (size == static_cast<ssize_t>(got.size()) && got == sent) return true;
  }
}

}  // namespace

std::string probe_multicast(const std::string& address, unsigned domain) {
  const auto port = static_cast<std::uint16_t>(7400 + 250 * domain);
  const FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!socket.is_open()) return failure("no socket");
  set_option(socket.get(), SOL_SOCKET, SO_REUSEADDR, 1);
  const sockaddr_in group = address_of(kGroup, port);
  ip_mreqn membership{};
  membership.imr_multiaddr = group.sin_addr;
  inet_pton(AF_INET, address.c_str(), &membership.imr_address);
  if (bind(socket.get(), reinterpret_cast<const sockaddr*>(&group), sizeof group) != 0)
    return failure(fmt::format("port {} cannot be shared", port));
  if (!set_option(socket.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, membership))
    return failure("the group cannot be joined");
  if (!set_option(socket.get(), IPPROTO_IP, IP_MULTICAST_IF, membership))
    return failure("the interface cannot be chosen");
  set_option(socket.get(), IPPROTO_IP, IP_MULTICAST_LOOP, 1);
  set_option(socket.get(), IPPROTO_IP, IP_MULTICAST_TTL, 0);
  const Header header = make_header();
  if (sendto(socket.get(), header.data(), header.size(), 0, reinterpret_cast<const sockaddr*>(&group),
             sizeof group) < 0)
    return failure("nothing can be sent");
  return comes_back(socket.get(), header) ? "" : "what was sent did not come back; a firewall may drop it";
}

}  // namespace doppel::doctor
