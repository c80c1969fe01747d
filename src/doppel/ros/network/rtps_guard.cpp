#include "doppel/ros/network/detail/rtps_guard.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include "doppel/ros/network/detail/rtps.h"

namespace doppel::ros2 {
namespace {

constexpr std::uint8_t kStatistics = 0x80;  // eProsima's own, behind each message of a Fast DDS peer
// In the bodies of HEARTBEAT and GAP, which both have two sequence numbers.
constexpr std::size_t kWriterAt = 4, kFirstSequenceAt = 8, kSecondSequenceAt = 16, kHeartbeatCountAt = 24,
                      kMinHeartbeat = 28, kMinGap = 28;
// In that of ACKNACK: the reader, the writer, and the first number that the reader may miss.
constexpr std::size_t kAcknowledgedAt = 8, kMinAcknowledgement = 24;
constexpr std::size_t kInfoSourceSize = 20;
constexpr std::int64_t kMaxSequence = std::int64_t{1} << 40;  // 35 years at 1 kHz
constexpr std::size_t kMaxWriters = 10'000;                   // those of strangers must not fill the memory

// Fast DDS keeps the list of missing fragments inside the sample: four bytes at the aligned beginning of each
// fragment, which it writes behind the end of the sample if the last fragment is shorter (CVE-2025-62799).
bool has_room_for_fragment_list(std::uint64_t fragment, std::uint64_t whole) {
  constexpr std::uint64_t kEntry = 4;
  if (whole <= fragment) return true;
  const std::uint64_t last = (whole - 1) / fragment * fragment;
  return fragment >= kEntry && ((last + 3) & ~std::uint64_t{3}) + kEntry <= whole;
}

bool is_possible_data(std::uint8_t kind, std::uint8_t flags, std::span<const std::uint8_t> body) {
  const bool little = (flags & rtps::kLittleEndian) != 0;
  const auto payload = rtps::payload(kind, flags, body);
  if (!payload) return false;
  if (kind == rtps::kData) return (flags & (rtps::kHasData | rtps::kHasKey)) == 0 || payload->size() >= 4;

  const std::uint64_t first = rtps::number(&body[rtps::kFirstFragmentAt], 4, little);
  const std::uint64_t count = rtps::number(&body[rtps::kFragmentCountAt], 2, little);
  const std::uint64_t size = rtps::number(&body[rtps::kFragmentSizeAt], 2, little);
  const std::uint64_t whole = rtps::number(&body[rtps::kSampleSizeAt], 4, little);
  if (first == 0 || count == 0 || size == 0 || whole > kMaxSampleBytes || (first - 1) * size >= whole ||
      !has_room_for_fragment_list(size, whole))
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

// Mirrors Fast DDS, which ignores a heartbeat that is impossible or whose count does not grow.
void RtpsGuard::note_available(const Writer& writer, std::int64_t first, std::int64_t last,
                               std::uint32_t count) {
  Progress& progress = writers_[writer];
  if (first <= 0 || last < first - 1 || count <= progress.heartbeat) return;
  progress.heartbeat = count;
  progress.available = std::max(progress.available, first);
}

// A gap is only accepted if it is consistent with its writer's samples and heartbeats. Fast DDS stores the
// numbers of gaps above the first available sample (CVE-2025-64438): the distance from it limits their
// memory.
bool RtpsGuard::admits_gap(const Writer& writer, std::int64_t first, std::int64_t end) {
  if (first < 0 || end < 0 || end > kMaxSequence) return false;
  const auto known = writers_.find(writer);
  const Progress progress = known != writers_.end() ? known->second : Progress{};
  if (end > first) gaps_ += end - first;
  return gaps_ <= kMaxGap && end - progress.available <= kMaxGap;
}

void RtpsGuard::note_acknowledgement(std::span<const std::uint8_t> body, bool little, const Writer& sender) {
  if (body.size() < kMinAcknowledgement || rtps::sequence(&body[kAcknowledgedAt], little) <= 0) return;
  Acknowledgement& noted = acknowledgements_.emplace_back();
  std::copy_n(sender.begin(), rtps::kPrefixSize, noted.reader.begin());
  std::copy_n(body.begin(), 4, noted.reader.begin() + rtps::kPrefixSize);
  std::copy_n(body.begin() + kWriterAt, 4, noted.writer.begin());
}

bool RtpsGuard::admits_submessage(std::uint8_t kind, std::uint8_t flags, std::span<const std::uint8_t> body,
                                  Writer& writer) {
  const bool little = (flags & rtps::kLittleEndian) != 0;
  const bool is_data = kind == rtps::kData || kind == rtps::kDataFragment;
  if (kind == rtps::kAcknowledgement) note_acknowledgement(body, little, writer);
  if (kind == rtps::kInfoSource) {
    if (body.size() != kInfoSourceSize) return false;
    std::copy_n(&body[rtps::kPrefixAt], rtps::kPrefixSize, writer.begin());
  }
  if (!is_data && kind != rtps::kHeartbeat && kind != rtps::kGap) return true;
  const std::size_t least = kind == rtps::kHeartbeat ? kMinHeartbeat : kMinGap;
  if (is_data ? !is_possible_data(kind, flags, body) : body.size() < least) return false;
  std::memcpy(writer.data() + rtps::kPrefixSize, &body[is_data ? rtps::kDataWriterAt : kWriterAt], 4);
  if (is_data) return admits_claim(writer, {rtps::sequence(&body[rtps::kDataSequenceAt], little)});
  const std::int64_t first = rtps::sequence(&body[kFirstSequenceAt], little);
  const std::int64_t second = rtps::sequence(&body[kSecondSequenceAt], little);
  if (kind == rtps::kGap) return admits_gap(writer, first, second);
  const std::uint32_t count = rtps::number(&body[kHeartbeatCountAt], 4, little);
  if (!admits_claim(writer, {std::max(first, second), count})) return false;
  note_available(writer, first, second, count);
  return true;
}

bool RtpsGuard::admits(std::span<const std::uint8_t> datagram) {
  acknowledgements_.clear();
  if (datagram.size() < rtps::kHeaderSize || std::memcmp(datagram.data(), "RTPS", 4) != 0) return false;
  if (writers_.size() > kMaxWriters) writers_.clear();
  gaps_ = 0;
  Writer writer{};
  std::memcpy(writer.data(), &datagram[rtps::kPrefixAt], rtps::kPrefixSize);
  datagram = datagram.subspan(rtps::kHeaderSize);
  while (datagram.size() >= rtps::kSubmessageHeaderSize) {
    const auto submessage = rtps::take_submessage(datagram);
    if (!submessage || !admits_submessage(submessage->kind, submessage->flags, submessage->body, writer))
      return false;
    // Fast DDS continues at the next multiple of four, where it would read other submessages than this check,
    // and aborts the process if anything follows the statistics.
    if (!datagram.empty() && (submessage->body.size() % 4 != 0 || submessage->kind == kStatistics))
      return false;
  }
  return true;
}

}  // namespace doppel::ros2
