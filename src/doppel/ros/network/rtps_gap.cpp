#include "doppel/ros/network/detail/rtps_gap.h"

#include <algorithm>

#include "doppel/ros/network/detail/rtps.h"

namespace doppel::ros2 {
namespace {

using Octets = std::vector<std::uint8_t>;

void append(Octets& to, std::span<const std::uint8_t> bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

void append(Octets& to, std::uint32_t value, bool little) {
  for (int i = 0; i < 4; ++i) to.push_back(static_cast<std::uint8_t>(value >> 8 * (little ? i : 3 - i)));
}

// Of the sample in `body`, a DATA or DATA_FRAG.
void append_gap(Octets& to, std::span<const std::uint8_t> body, bool little) {
  constexpr std::uint8_t kSize = 28;
  to.insert(to.end(), {rtps::kGap, static_cast<std::uint8_t>(little ? rtps::kLittleEndian : 0)});
  to.insert(to.end(),
            {static_cast<std::uint8_t>(little ? kSize : 0), static_cast<std::uint8_t>(little ? 0 : kSize)});
  append(to, body.subspan(rtps::kDataReaderAt, 4));
  append(to, body.subspan(rtps::kDataWriterAt, 4));
  append(to, body.subspan(rtps::kDataSequenceAt, 8));
  std::uint64_t next = 0;  // the first number that is no longer part of the gap
  for (const std::size_t half : {rtps::kDataSequenceAt, rtps::kDataSequenceAt + 4}) {
    for (std::size_t i = 0; i < 4; ++i) next = next << 8 | body[half + (little ? 3 - i : i)];
  }
  ++next;
  append(to, static_cast<std::uint32_t>(next >> 32), little);
  append(to, static_cast<std::uint32_t>(next), little);
  append(to, 0, little);  // no further numbers
}

}  // namespace

std::vector<std::uint8_t> without_samples(std::span<const std::uint8_t> datagram,
                                          const std::array<std::uint8_t, 4>& writer) {
  if (datagram.size() < rtps::kHeaderSize) return {};
  Octets result(datagram.begin(), datagram.begin() + rtps::kHeaderSize);
  datagram = datagram.subspan(rtps::kHeaderSize);
  bool found = false;
  while (datagram.size() >= rtps::kSubmessageHeaderSize) {
    const auto submessage = rtps::take_submessage(datagram);
    if (!submessage) return {};
    const rtps::Bytes body = submessage->body;
    if (submessage->has_sample() && body.size() >= rtps::kMinDataSize &&
        std::ranges::equal(body.subspan(rtps::kDataWriterAt, 4), writer)) {
      append_gap(result, body, submessage->is_little());
      found = true;
    } else {
      append(result, submessage->whole);
    }
  }
  return found ? result : Octets();
}

}  // namespace doppel::ros2
