// Fuzz target: the bytes are datagrams, each with its length in two bytes, as unknown senders may send them
// to one port. None may be read beyond its end, an accepted one must begin like RTPS, the reduction of
// announcements must not change its own result, and a new writer's sample must be accepted afterwards.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "doppel/ros/network/detail/rtps_discovery.h"
#include "doppel/ros/network/detail/rtps_guard.h"

namespace {

constexpr std::size_t kHeaderSize = 20;

// The first sample of a writer: four bytes of payload in a DATA submessage, little endian.
std::vector<std::uint8_t> first_sample() {
  std::vector<std::uint8_t> d{'R', 'T', 'P', 'S', 2, 3, 1, 15};
  d.resize(kHeaderSize, 0xEE);
  const std::uint8_t data[] = {0x15, 0x05, 24, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0,
                               1,    3,    0,  0, 0, 0, 1,  0, 0, 0, 0, 1, 0, 0};
  d.insert(d.end(), std::begin(data), std::end(data));
  return d;
}

bool begins_as_rtps(std::span<const std::uint8_t> datagram) {
  constexpr std::string_view kMagic = "RTPS";
  return datagram.size() >= kHeaderSize && std::ranges::equal(datagram.first(kMagic.size()), kMagic);
}

void check_reduction(doppel::ros2::RtpsDiscovery& discovery, std::span<const std::uint8_t> datagram) {
  if (!doppel::ros2::has_announcement(datagram)) return;
  const auto reduced = discovery.reduced(datagram);
  if (!reduced) return;
  const std::vector<std::uint8_t> once(reduced->begin(), reduced->end());
  doppel::ros2::RtpsDiscovery another(std::make_shared<doppel::ros2::AnnouncedEndpoints>());
  const auto twice = another.reduced(once);
  if (!twice || !std::ranges::equal(*twice, once)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  doppel::ros2::RtpsGuard guard;
  doppel::ros2::RtpsDiscovery discovery(std::make_shared<doppel::ros2::AnnouncedEndpoints>());
  for (std::span rest(data, size); rest.size() >= 2;) {
    const std::size_t length = std::size_t{rest[0]} << 8 | rest[1];
    rest = rest.subspan(2);
    // A separate copy, so that a read beyond the end is detected.
    const std::vector<std::uint8_t> datagram(rest.begin(), rest.begin() + std::min(length, rest.size()));
    if (guard.admits(datagram)) {
      if (!begins_as_rtps(datagram)) std::abort();
      check_reduction(discovery, datagram);
    }
    rest = rest.subspan(datagram.size());
  }
  if (!guard.admits(first_sample())) std::abort();
  return 0;
}
