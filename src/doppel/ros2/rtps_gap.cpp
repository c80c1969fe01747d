#include "doppel/ros2/detail/rtps_gap.h"

#include <algorithm>

namespace doppel::ros2 {
namespace {

// DDSI-RTPS 2.5, 8.3.3 and 9.4.5.
constexpr std::size_t kHeaderSize = 20, kSubmessageHeaderSize = 4;
constexpr std::uint8_t kGap = 0x08, kData = 0x15, kDataFragment = 0x16;
constexpr std::uint8_t kLittleEndian = 0x01;
constexpr std::size_t kReaderAt = 4, kWriterAt = 8, kSequenceAt = 12, kLeastData = 20;  // DATA and DATA_FRAG

using Bytes = std::vector<std::uint8_t>;

std::size_t number(std::span<const std::uint8_t> bytes, bool little) {
  return little ? bytes[0] | bytes[1] << 8 : bytes[0] << 8 | bytes[1];
}

void append(Bytes& to, std::span<const std::uint8_t> bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

void append(Bytes& to, std::uint32_t value, bool little) {
  for (int i = 0; i < 4; ++i) to.push_back(static_cast<std::uint8_t>(value >> 8 * (little ? i : 3 - i)));
}

// Of the sample in `body`, a DATA or DATA_FRAG.
void append_gap(Bytes& to, std::span<const std::uint8_t> body, bool little) {
  constexpr std::uint8_t kSize = 28;
  to.insert(to.end(), {kGap, static_cast<std::uint8_t>(little ? kLittleEndian : 0)});
  to.insert(to.end(),
            {static_cast<std::uint8_t>(little ? kSize : 0), static_cast<std::uint8_t>(little ? 0 : kSize)});
  append(to, body.subspan(kReaderAt, 4));
  append(to, body.subspan(kWriterAt, 4));
  append(to, body.subspan(kSequenceAt, 8));
  std::uint64_t next = 0;  // the first number that is no longer part of the gap
  for (const std::size_t half : {kSequenceAt, kSequenceAt + 4}) {
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
  if (datagram.size() < kHeaderSize) return {};
  Bytes result(datagram.begin(), datagram.begin() + kHeaderSize);
  datagram = datagram.subspan(kHeaderSize);
  bool found = false;
  while (datagram.size() >= kSubmessageHeaderSize) {
    const bool is_data = datagram[0] == kData || datagram[0] == kDataFragment;
    const bool little = (datagram[1] & kLittleEndian) != 0;
    std::size_t size = number(datagram.subspan(2, 2), little);
    const std::size_t left = datagram.size() - kSubmessageHeaderSize;
    if (size == 0 && is_data) size = left;  // it is the last one
    if (size > left) return {};
    const auto body = datagram.subspan(kSubmessageHeaderSize, size);
    if (is_data && size >= kLeastData && std::ranges::equal(body.subspan(kWriterAt, 4), writer)) {
      append_gap(result, body, little);
      found = true;
    } else {
      append(result, datagram.first(kSubmessageHeaderSize + size));
    }
    datagram = datagram.subspan(kSubmessageHeaderSize + size);
  }
  return found ? result : Bytes();
}

}  // namespace doppel::ros2
