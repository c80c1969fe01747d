#pragma once
// RTPS messages as bytes: DDSI-RTPS 2.5, 8.3.3 and 9.4.5.

#include <cstddef>
#include <cstdint>

namespace doppel::ros2::rtps {

inline constexpr std::size_t kHeaderSize = 20, kSubmessageHeaderSize = 4;
// Kinds of submessages.
inline constexpr std::uint8_t kPad = 0x01, kAcknowledgement = 0x06, kHeartbeat = 0x07, kGap = 0x08,
                              kInfoTimestamp = 0x09, kData = 0x15, kDataFragment = 0x16;
// A flag of every submessage.
inline constexpr std::uint8_t kLittleEndian = 0x01;
// In the bodies of DATA and DATA_FRAG; kMinDataSize: up to the end of the sequence number.
inline constexpr std::size_t kDataReaderAt = 4, kDataWriterAt = 8, kDataSequenceAt = 12, kMinDataSize = 20;

// An unsigned number of at most four bytes.
inline std::uint32_t number(const std::uint8_t* bytes, std::size_t width, bool little) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < width; ++i) value = value << 8 | bytes[little ? width - 1 - i : i];
  return value;
}

}  // namespace doppel::ros2::rtps
