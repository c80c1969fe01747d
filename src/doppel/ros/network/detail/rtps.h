#pragma once
// RTPS messages as bytes: DDSI-RTPS 2.5, 8.3.3, 9.4.2 and 9.4.5.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace doppel::ros2::rtps {

using Bytes = std::span<const std::uint8_t>;

inline constexpr std::size_t kHeaderSize = 20, kSubmessageHeaderSize = 4;
// The sender in the header, as in the body of INFO_SRC, which names another one for what follows.
inline constexpr std::size_t kPrefixAt = 8, kPrefixSize = 12;
// Kinds of submessages.
inline constexpr std::uint8_t kPad = 0x01, kAcknowledgement = 0x06, kHeartbeat = 0x07, kGap = 0x08,
                              kInfoTimestamp = 0x09, kInfoSource = 0x0c, kData = 0x15, kDataFragment = 0x16;
// A flag of every submessage.
inline constexpr std::uint8_t kLittleEndian = 0x01;
// Flags of DATA and DATA_FRAG; a fragment always has data or a key.
inline constexpr std::uint8_t kHasInlineQos = 0x02, kHasData = 0x04, kHasKey = 0x08;
// In the bodies of DATA and DATA_FRAG; kMinDataSize: up to the end of the sequence number.
inline constexpr std::size_t kDataReaderAt = 4, kDataWriterAt = 8, kDataSequenceAt = 12, kMinDataSize = 20;
// In the body of DATA_FRAG.
inline constexpr std::size_t kFirstFragmentAt = 20, kFragmentCountAt = 24, kFragmentSizeAt = 26,
                             kSampleSizeAt = 28, kMinFragmentSize = 32;

// An unsigned number of at most four bytes.
inline std::uint32_t number(const std::uint8_t* bytes, std::size_t width, bool little) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < width; ++i) value = value << 8 | bytes[little ? width - 1 - i : i];
  return value;
}

// A sequence number: its upper half comes first in either byte order.
inline std::int64_t sequence(const std::uint8_t* bytes, bool little) {
  const std::uint64_t high = number(bytes, 4, little);
  return static_cast<std::int64_t>(high << 32 | number(bytes + 4, 4, little));
}

struct Submessage {
  std::uint8_t kind = 0, flags = 0;
  Bytes whole, body;  // with and without its header
  [[nodiscard]] bool is_little() const { return (flags & kLittleEndian) != 0; }
  [[nodiscard]] bool has_sample() const { return kind == kData || kind == kDataFragment; }
};

// The first submessage of those behind a header, which then begin behind it; nothing if it exceeds them.
std::optional<Submessage> take_submessage(Bytes& submessages);

struct Parameter {
  std::uint16_t id = 0;
  Bytes value;  // with its padding, a multiple of four bytes
};
inline constexpr std::uint16_t kSentinel = 1;  // the id that ends a list

// The first parameter of a list, which then begins behind it; nothing if it exceeds the list.
std::optional<Parameter> take_parameter(Bytes& list, bool little);

// The part of DATA or DATA_FRAG behind its inline QoS: a sample, a part of one, or nothing (empty); `body`
// is without the header. Nothing (nullopt) if the parts exceed the whole, which Fast DDS does not check
// before it subtracts their sizes, or if a parameter of the inline QoS is shorter than its type.
std::optional<Bytes> payload(std::uint8_t kind, std::uint8_t flags, Bytes body);

}  // namespace doppel::ros2::rtps
