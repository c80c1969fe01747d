#include "doppel/ros2/rtps_guard.h"

#include <cstring>

namespace doppel::ros2 {
namespace {

// DDSI-RTPS 2.5, 8.3.3 and 9.4.5.
constexpr std::size_t kHeaderSize = 20, kSubmessageHeaderSize = 4;
constexpr std::uint8_t kPad = 0x01, kInfoTimestamp = 0x09, kDataFragment = 0x16;
constexpr std::uint8_t kLittleEndian = 0x01;
// In the body of DATA_FRAG.
constexpr std::size_t kFirstFragmentAt = 20, kFragmentCountAt = 24, kFragmentSizeAt = 26, kSampleSizeAt = 28,
                      kLeastFragmentBody = 32;

std::uint32_t number(const std::uint8_t* bytes, std::size_t width, bool little) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < width; ++i) value = value << 8 | bytes[little ? width - 1 - i : i];
  return value;
}

bool is_acceptable_fragment(std::span<const std::uint8_t> body, bool little) {
  if (body.size() < kLeastFragmentBody) return false;
  return number(&body[kFirstFragmentAt], 4, little) > 0 && number(&body[kFragmentCountAt], 2, little) > 0 &&
         number(&body[kFragmentSizeAt], 2, little) > 0 &&
         number(&body[kSampleSizeAt], 4, little) <= kLargestSample;
}

}  // namespace

bool is_acceptable(std::span<const std::uint8_t> datagram) {
  if (datagram.size() < kHeaderSize || std::memcmp(datagram.data(), "RTPS", 4) != 0) return false;
  datagram = datagram.subspan(kHeaderSize);
  while (datagram.size() >= kSubmessageHeaderSize) {
    const std::uint8_t kind = datagram[0];
    const bool little = (datagram[1] & kLittleEndian) != 0;
    std::size_t size = number(&datagram[2], 2, little);
    datagram = datagram.subspan(kSubmessageHeaderSize);
    if (size == 0 && kind != kPad && kind != kInfoTimestamp) size = datagram.size();  // it is the last one
    if (size > datagram.size()) return false;
    if (kind == kDataFragment && !is_acceptable_fragment(datagram.first(size), little)) return false;
    datagram = datagram.subspan(size);
  }
  return true;
}

}  // namespace doppel::ros2
