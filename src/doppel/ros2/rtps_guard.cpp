#include "doppel/ros2/rtps_guard.h"

#include <algorithm>
#include <cstring>
#include <optional>

namespace doppel::ros2 {
namespace {

// DDSI-RTPS 2.5, 8.3.3 and 9.4.5.
constexpr std::size_t kHeaderSize = 20, kPrefixAt = 8, kPrefixSize = 12, kSubmessageHeaderSize = 4;
constexpr std::uint8_t kPad = 0x01, kAcknowledgement = 0x06, kGap = 0x08, kHeartbeat = 0x07,
                       kInfoTimestamp = 0x09, kData = 0x15, kDataFragment = 0x16;
constexpr std::uint8_t kStatistics = 0x80;  // eProsima's own, behind each message of a Fast DDS peer
constexpr std::uint8_t kLittleEndian = 0x01;
constexpr std::uint8_t kHasInlineQos = 0x02, kHasData = 0x04,
                       kHasKey = 0x08;  // a fragment always has one of the two
constexpr std::uint32_t kSentinel = 1;
// In the bodies of DATA and DATA_FRAG, and of HEARTBEAT and GAP, which both tell two sequence numbers.
constexpr std::size_t kOffsetAt = 2, kOffsetFrom = 4, kDataWriterAt = 8, kDataSequenceAt = 12,
                      kLeastData = 20;
constexpr std::size_t kWriterAt = 4, kFirstSequenceAt = 8, kSecondSequenceAt = 16, kHeartbeatCountAt = 24,
                      kLeastHeartbeat = 28, kLeastGap = 28;
// In that of ACKNACK: the reader, the writer, and the first number that the reader may miss.
constexpr std::size_t kAcknowledgedAt = 8, kLeastAcknowledgement = 24;
// In that of DATA_FRAG.
constexpr std::size_t kFirstFragmentAt = 20, kFragmentCountAt = 24, kFragmentSizeAt = 26, kSampleSizeAt = 28,
                      kLeastFragment = 32;
constexpr std::int64_t kLargestSequence = std::int64_t{1} << 40;  // 35 years at 1 kHz
constexpr std::size_t kMostWriters = 10'000;  // those of strangers must not fill the memory

std::uint32_t number(const std::uint8_t* bytes, std::size_t width, bool little) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < width; ++i) value = value << 8 | bytes[little ? width - 1 - i : i];
  return value;
}

std::int64_t sequence(const std::uint8_t* bytes, bool little) {
  const std::uint64_t high = number(bytes, 4, little);
  return static_cast<std::int64_t>(high << 32 | number(bytes + 4, 4, little));
}

// What follows a list of parameters; nothing where the list does not end.
std::optional<std::span<const std::uint8_t>> behind_parameters(std::span<const std::uint8_t> list,
                                                               bool little) {
  while (list.size() >= 4) {
    const std::uint32_t id = number(list.data(), 2, little);
    const std::size_t size = id == kSentinel ? 0 : (number(&list[2], 2, little) + 3) & ~std::size_t{3};
    if (size > list.size() - 4) return std::nullopt;
    list = list.subspan(4 + size);
    if (id == kSentinel) return list;
  }
  return std::nullopt;
}

// Fast DDS takes the sizes of the parts at their word and subtracts them from the whole.
bool is_possible_data(std::uint8_t kind, std::uint8_t flags, std::span<const std::uint8_t> body) {
  const bool little = (flags & kLittleEndian) != 0;
  const std::size_t fixed = kind == kData ? kLeastData : kLeastFragment;
  if (body.size() < fixed) return false;
  const std::size_t begin = kOffsetFrom + number(&body[kOffsetAt], 2, little);
  if (begin < fixed || begin > body.size()) return false;
  std::optional payload = body.subspan(begin);
  if ((flags & kHasInlineQos) != 0) payload = behind_parameters(*payload, little);
  if (!payload) return false;
  if (kind == kData) return (flags & (kHasData | kHasKey)) == 0 || payload->size() >= 4;

  const std::uint64_t first = number(&body[kFirstFragmentAt], 4, little);
  const std::uint64_t count = number(&body[kFragmentCountAt], 2, little);
  const std::uint64_t size = number(&body[kFragmentSizeAt], 2, little);
  const std::uint64_t whole = number(&body[kSampleSizeAt], 4, little);
  if (first == 0 || count == 0 || size == 0 || whole > kLargestSample || (first - 1) * size >= whole)
    return false;
  const std::uint64_t told = std::min(count * size, whole - (first - 1) * size);
  return (first + count - 2) * size < whole && payload->size() >= told && payload->size() < told + 4;
}

}  // namespace

bool RtpsGuard::admits_claim(const Writer& writer, const Claim& claim) {
  if (claim.sequence < 0 || claim.sequence > kLargestSequence) return false;
  Progress& progress = writers_[writer];
  const std::int64_t jump = claim.sequence - progress.reached;
  const std::int64_t further = claim.sequence - progress.leap.sequence;
  const bool confirms = progress.leap != Claim{} && progress.leap != claim && further >= 0 &&
                        further <= kLargestJump && jump <= kLargestLeap;
  const bool fits = confirms || jump <= kLargestJump;
  progress.leap = fits ? Claim{} : claim;
  if (fits) progress.reached = std::max(progress.reached, claim.sequence);
  return fits;
}

// Nothing is believed of a gap that its writer's samples and heartbeats do not say.
bool RtpsGuard::admits_gap(const Writer& writer, std::int64_t first, std::int64_t end) {
  if (first < 0 || end < 0 || end > kLargestSequence) return false;
  const auto known = writers_.find(writer);
  const std::int64_t reached = known != writers_.end() ? known->second.reached : 0;
  if (end > first) gaps_ += end - first;
  return gaps_ <= kWidestGap && end - reached <= kLargestJump;
}

void RtpsGuard::note_acknowledgement(std::span<const std::uint8_t> body, bool little, const Writer& sender) {
  if (body.size() < kLeastAcknowledgement || sequence(&body[kAcknowledgedAt], little) <= 0) return;
  Acknowledgement& noted = acknowledgements_.emplace_back();
  std::copy_n(sender.begin(), kPrefixSize, noted.reader.begin());
  std::copy_n(body.begin(), 4, noted.reader.begin() + kPrefixSize);
  std::copy_n(body.begin() + kWriterAt, 4, noted.writer.begin());
}

bool RtpsGuard::admits_submessage(std::uint8_t kind, std::uint8_t flags, std::span<const std::uint8_t> body,
                                  Writer& writer) {
  const bool little = (flags & kLittleEndian) != 0;
  const bool is_data = kind == kData || kind == kDataFragment;
  if (kind == kAcknowledgement) note_acknowledgement(body, little, writer);
  if (!is_data && kind != kHeartbeat && kind != kGap) return true;
  const std::size_t least = kind == kHeartbeat ? kLeastHeartbeat : kLeastGap;
  if (is_data ? !is_possible_data(kind, flags, body) : body.size() < least) return false;
  std::memcpy(writer.data() + kPrefixSize, &body[is_data ? kDataWriterAt : kWriterAt], 4);
  if (is_data) return admits_claim(writer, {sequence(&body[kDataSequenceAt], little)});
  const std::int64_t first = sequence(&body[kFirstSequenceAt], little);
  const std::int64_t second = sequence(&body[kSecondSequenceAt], little);
  if (kind == kGap) return admits_gap(writer, first, second);
  return admits_claim(writer, {std::max(first, second), number(&body[kHeartbeatCountAt], 4, little)});
}

bool RtpsGuard::admits(std::span<const std::uint8_t> datagram) {
  acknowledgements_.clear();
  if (datagram.size() < kHeaderSize || std::memcmp(datagram.data(), "RTPS", 4) != 0) return false;
  if (writers_.size() > kMostWriters) writers_.clear();
  gaps_ = 0;
  Writer writer{};
  std::memcpy(writer.data(), &datagram[kPrefixAt], kPrefixSize);
  datagram = datagram.subspan(kHeaderSize);
  while (datagram.size() >= kSubmessageHeaderSize) {
    const std::uint8_t kind = datagram[0];
    const std::uint8_t flags = datagram[1];
    std::size_t size = number(&datagram[2], 2, (flags & kLittleEndian) != 0);
    datagram = datagram.subspan(kSubmessageHeaderSize);
    if (size == 0 && kind != kPad && kind != kInfoTimestamp) size = datagram.size();  // it is the last one
    if (size > datagram.size() || !admits_submessage(kind, flags, datagram.first(size), writer)) return false;
    // Fast DDS goes on at the next multiple of four, where other submessages would stand than here, and
    // aborts the process where something follows the statistics.
    if (size < datagram.size() && (size % 4 != 0 || kind == kStatistics)) return false;
    datagram = datagram.subspan(size);
  }
  return true;
}

}  // namespace doppel::ros2
