#pragma once
// A look at datagrams before Fast DDS believes them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>

namespace doppel::ros2 {

// Memory for a whole sample is taken when its first fragment comes, on the word of whoever sent it.
constexpr std::uint32_t kLargestSample = 256u * 1024 * 1024;
// Fast DDS counts through all sequence numbers that a heartbeat or a gap leaves out, with the reader locked:
// one packet of nonsense would stop it for hours.
constexpr std::int64_t kLargestJump = 10'000'000;

// One thread at a time.
class RtpsGuard {
 public:
  // False for what is no RTPS message or one that Fast DDS would read otherwise than this, for fragments of
  // nothing or of more than kLargestSample, and for sequence numbers that leap ahead of what their writer has
  // sent before, unless it says so again (it has been out of reach for hours).
  bool admits(std::span<const std::uint8_t> datagram);

 private:
  using Writer = std::array<std::uint8_t, 16>;
  struct Progress {
    std::int64_t reached = 0, claimed = 0;
  };
  bool admits_submessage(std::uint8_t kind, std::uint8_t flags, std::span<const std::uint8_t> body,
                         Writer& writer);
  bool admits_sequence(const Writer& writer, std::int64_t sequence);

  std::map<Writer, Progress> writers_;
};

}  // namespace doppel::ros2
