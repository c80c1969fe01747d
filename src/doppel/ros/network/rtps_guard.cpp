#include "doppel/ros/network/detail/rtps_guard.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include "doppel/ros/network/detail/rtps.h"

namespace doppel::ros2 {
namespace {

constexpr std::size_t kPrefixAt = 8, kPrefixSize = 12;  // in the header
constexpr std::uint8_t kStatistics = 0x80;  // eProsima's own, behind each message of a Fast DDS peer
constexpr std::uint8_t kHasInlineQos = 0x02, kHasData = 0x04,
                       kHasKey = 0x08;  // a fragment always has one of the two
constexpr std::uint32_t kSentinel = 1;
// In the bodies of DATA and DATA_FRAG, and of HEARTBEAT and GAP, which both have two sequence numbers.
constexpr std::size_t kOffsetAt = 2, kOffsetFrom = 4;
constexpr std::size_t kWriterAt = 4, kFirstSequenceAt = 8, kSecondSequenceAt = 16, kHeartbeatCountAt = 24,
                      kMinHeartbeat = 28, kMinGap = 28;
// In that of ACKNACK: the reader, the writer, and the first number that the reader may miss.
constexpr std::size_t kAcknowledgedAt = 8, kMinAcknowledgement = 24;
// In that of DATA_FRAG.
constexpr std::size_t kFirstFragmentAt = 20, kFragmentCountAt = 24, kFragmentSizeAt = 26, kSampleSizeAt = 28,
                      kMinFragment = 32;
constexpr std::int64_t kMaxSequence = std::int64_t{1} << 40;  // 35 years at 1 kHz
constexpr std::size_t kMaxWriters = 10'000;                   // those of strangers must not fill the memory

std::int64_t sequence(const std::uint8_t* bytes, bool little) {
  const std::uint64_t high = rtps::number(bytes, 4, little);
  return static_cast<std::int64_t>(high << 32 | rtps::number(bytes + 4, 4, little));
}

// The bytes that follow a list of parameters; nothing where the list does not end.
std::optional<std::span<const std::uint8_t>> behind_parameters(std::span<const std::uint8_t> list,
                                                               bool little) {
  while (list.size() >= 4) {
    const std::uint32_t id = rtps::number(list.data(), 2, little);
    const std::size_t size = id == kSentinel ? 0 : (rtps::number(&list[2], 2, little) + 3) & ~std::size_t{3};
    if (size > list.size() - 4) return std::nullopt;
    list = list.subspan(4 + size);
    if (id == kSentinel) return list;
  }
  return std::nullopt;
}

// Fast DDS does not check the sizes of the parts before it subtracts them from that of the whole.
bool is_possible_data(std::uint8_t kind, std::uint8_t flags, std::span<const std::uint8_t> body) {
  const bool little = (flags & rtps::kLittleEndian) != 0;
  const std::size_t fixed = kind == rtps::kData ? rtps::kMinDataSize : kMinFragment;
  if (body.size() < fixed) return false;
  const std::size_t begin = kOffsetFrom + rtps::number(&body[kOffsetAt], 2, little);
  if (begin < fixed || begin > body.size()) return false;
  std::optional payload = body.subspan(begin);
  if ((flags & kHasInlineQos) != 0) payload = behind_parameters(*payload, little);
  if (!payload) return false;
  if (kind == rtps::kData) return (flags & (kHasData | kHasKey)) == 0 || payload->size() >= 4;

  const std::uint64_t first = rtps::number(&body[kFirstFragmentAt], 4, little);
  const std::uint64_t count = rtps::number(&body[kFragmentCountAt], 2, little);
  const std::uint64_t size = rtps::number(&body[kFragmentSizeAt], 2, little);
  const std::uint64_t whole = rtps::number(&body[kSampleSizeAt], 4, little);
  if (first == 0 || count == 0 || size == 0 || whole > kMaxSampleBytes || (first - 1) * size >= whole)
    return false;
  const std::uint64_t declared = std::min(count * size, whole - (first - 1) * size);
  return (first + count - 2) * size < whole && payload->size() >= declared && payload->size() < declared + 4;
}

}  // namespace

bool RtpsGuard::admits_claim(const Writer& writer, const Claim& claim) {
  if (claim.sequence < 0 || claim.sequence > kMaxSequence) return false;
  Progress& progress = writers_[writer];
  const std::int64_t jump = claim.sequence - progress.reached;
  const std::int64_t further = claim.sequence - progress.leap.sequence;
  const bool confirms = progress.leap != Claim{} && progress.leap != claim && further >= 0 &&
                        further <= kMaxSequenceJump && jump <= kMaxSequenceLeap;
  const bool fits = confirms || jump <= kMaxSequenceJump;
  progress.leap = fits ? Claim{} : claim;
  if (fits) progress.reached = std::max(progress.reached, claim.sequence);
  return fits;
}

// A gap is only accepted if it is consistent with its writer's samples and heartbeats.
bool RtpsGuard::admits_gap(const Writer& writer, std::int64_t first, std::int64_t end) {
  if (first < 0 || end < 0 || end > kMaxSequence) return false;
  const auto known = writers_.find(writer);
  const std::int64_t reached = known != writers_.end() ? known->second.reached : 0;
  if (end > first) gaps_ += end - first;
  return gaps_ <= kMaxGap && end - reached <= kMaxSequenceJump;
}

void RtpsGuard::note_acknowledgement(std::span<const std::uint8_t> body, bool little, const Writer& sender) {
  if (body.size() < kMinAcknowledgement || sequence(&body[kAcknowledgedAt], little) <= 0) return;
  Acknowledgement& noted = acknowledgements_.emplace_back();
  std::copy_n(sender.begin(), kPrefixSize, noted.reader.begin());
  std::copy_n(body.begin(), 4, noted.reader.begin() + kPrefixSize);
  std::copy_n(body.begin() + kWriterAt, 4, noted.writer.begin());
}

bool RtpsGuard::admits_submessage(std::uint8_t kind, std::uint8_t flags, std::span<const std::uint8_t> body,
                                  Writer& writer) {
  const bool little = (flags & rtps::kLittleEndian) != 0;
  const bool is_data = kind == rtps::kData || kind == rtps::kDataFragment;
  if (kind == rtps::kAcknowledgement) note_acknowledgement(body, little, writer);
  if (!is_data && kind != rtps::kHeartbeat && kind != rtps::kGap) return true;
  const std::size_t least = kind == rtps::kHeartbeat ? kMinHeartbeat : kMinGap;
  if (is_data ? !is_possible_data(kind, flags, body) : body.size() < least) return false;
  std::memcpy(writer.data() + kPrefixSize, &body[is_data ? rtps::kDataWriterAt : kWriterAt], 4);
  if (is_data) return admits_claim(writer, {sequence(&body[rtps::kDataSequenceAt], little)});
  const std::int64_t first = sequence(&body[kFirstSequenceAt], little);
  const std::int64_t second = sequence(&body[kSecondSequenceAt], little);
  if (kind == rtps::kGap) return admits_gap(writer, first, second);
  return admits_claim(writer, {std::max(first, second), rtps::number(&body[kHeartbeatCountAt], 4, little)});
}

bool RtpsGuard::admits(std::span<const std::uint8_t> datagram) {
  acknowledgements_.clear();
  if (datagram.size() < rtps::kHeaderSize || std::memcmp(datagram.data(), "RTPS", 4) != 0) return false;
  if (writers_.size() > kMaxWriters) writers_.clear();
  gaps_ = 0;
  Writer writer{};
  std::memcpy(writer.data(), &datagram[kPrefixAt], kPrefixSize);
  datagram = datagram.subspan(rtps::kHeaderSize);
  while (datagram.size() >= rtps::kSubmessageHeaderSize) {
    const std::uint8_t kind = datagram[0];
    const std::uint8_t flags = datagram[1];
    std::size_t size = rtps::number(&datagram[2], 2, (flags & rtps::kLittleEndian) != 0);
    datagram = datagram.subspan(rtps::kSubmessageHeaderSize);
    if (size == 0 && kind != rtps::kPad && kind != rtps::kInfoTimestamp)
      size = datagram.size();  // it is the last one
    if (size > datagram.size() || !admits_submessage(kind, flags, datagram.first(size), writer)) return false;
    // Fast DDS continues at the next multiple of four, where it would read other submessages than this check,
    // and aborts the process if anything follows the statistics.
    if (size < datagram.size() && (size % 4 != 0 || kind == kStatistics)) return false;
    datagram = datagram.subspan(size);
  }
  return true;
}

}  // namespace doppel::ros2
