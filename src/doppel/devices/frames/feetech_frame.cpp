#include "doppel/devices/frames/feetech_frame.h"

#include <algorithm>

#include "doppel/devices/frames/checksums.h"

namespace doppel {
namespace {

constexpr std::uint8_t kStartByte = 0xFF;
constexpr std::size_t kFrameAround = 6;     // bytes of a frame without parameters
constexpr std::size_t kBeforeId = 2;        // of the header
constexpr std::size_t kMinFrameLength = 2;  // of a frame without parameters

}  // namespace

void add_feetech_frame(const FeetechFrame& frame, FrameBytes& out) {
  check_frame_size("the parameters of a Feetech frame", frame.parameters.size(), kFeetechMaxParameters);
  const std::size_t begin = out.size() + kBeforeId;
  out.add(kStartByte);
  out.add(kStartByte);
  out.add(frame.id);
  out.add(static_cast<std::uint8_t>(frame.parameters.size() + kMinFrameLength));
  out.add(frame.code);
  out.add(frame.parameters);
  out.add(feetech_sum(out.bytes().subspan(begin)));
}

void FeetechReader::skip(std::size_t count) {
  counts_.noise += count;
  received_.advance(count);
}

std::optional<FeetechFrame> FeetechReader::next() {
  for (;;) {
    const std::span<const std::uint8_t> rest = received_.rest();
    // A third 0xFF belongs to the header: no servo has that id.
    const auto id = std::ranges::find_if(rest, [](std::uint8_t byte) { return byte != kStartByte; });
    const auto headers = static_cast<std::size_t>(id - rest.begin());
    if (headers > kBeforeId) skip(headers - kBeforeId);
    if (headers > kBeforeId) continue;
    if (headers < kBeforeId && id != rest.end()) {
      skip(headers + 1);
      continue;
    }
    if (rest.size() < kFrameAround - 1) return std::nullopt;
    const std::size_t length = rest[3];
    if (length < kMinFrameLength) {
      skip(1);
      continue;
    }
    const std::size_t size = length + kFrameAround - kMinFrameLength;
    if (rest.size() < size) return std::nullopt;
    if (feetech_sum(rest.subspan(kBeforeId, size - kBeforeId - 1)) != rest[size - 1]) {
      ++counts_.bad_checks;
      skip(1);
      continue;
    }
    received_.advance(size);
    ++counts_.frames;
    return FeetechFrame{rest[2], rest[4], rest.subspan(kFrameAround - 1, length - kMinFrameLength)};
  }
}

}  // namespace doppel
