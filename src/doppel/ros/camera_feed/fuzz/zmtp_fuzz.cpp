// Fuzz target: a subscriber of the pictures. The first byte is the number of bytes that arrive at once, and
// that it reads at once.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "doppel/ros/camera_feed/detail/zmtp_peer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t part = std::max<std::size_t>(1, data[0]);
  std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  doppel::ZmtpPeer peer;
  while (!rest.empty()) {
    const std::size_t count = std::min(part, rest.size());
    if (!peer.receive(rest.substr(0, count))) return 0;
    rest.remove_prefix(count);
    if (peer.subscribes("picture")) peer.send("picture");
    peer.take(std::min(part, peer.waiting().size()));
  }
  return 0;
}
