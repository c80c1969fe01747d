#pragma once
// Datagrams that no DDS implementation has written, to the ports of a twin on this machine.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "fast_peer.h"

namespace doppel::ros2_testing {

using Octets = std::vector<std::uint8_t>;

class DatagramSocket {
 public:
  DatagramSocket() : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~DatagramSocket() { close(socket_); }
  DatagramSocket(const DatagramSocket&) = delete;
  DatagramSocket& operator=(const DatagramSocket&) = delete;

  void send(int port, const Octets& bytes) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&address),
           sizeof address);
  }

 private:
  int socket_;
};

// The twin as discovered.
inline std::pair<GUID_t, SeenParticipant> twin_as_seen_by(const FastPeer& peer) {
  std::pair<GUID_t, SeenParticipant> found;
  EXPECT_TRUE(eventually([&] {
    for (const SeenEndpoint& endpoint : peer.endpoints())
      for (const auto& [guid, participant] : peer.participants())
        if (endpoint.topic == "rt/joint_states" && endpoint.is_writer &&
            endpoint.guid.guidPrefix == guid.guidPrefix)
          found = {guid, participant};
    return !found.second.ports.empty();
  }));
  return found;
}

}  // namespace doppel::ros2_testing
