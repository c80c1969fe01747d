#pragma once
// A check of datagrams before Fast DDS processes them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace doppel::ros2 {

// Fast DDS allocates memory for a whole sample at its first fragment, with the size that the sender declares.
constexpr std::uint32_t kMaxSampleBytes = 64u * 1024 * 1024;
// Fast DDS iterates over all sequence numbers that a heartbeat or a gap skips, five million per second, with
// the reader locked and the port unread: one invalid packet could block it for hours.
constexpr std::int64_t kMaxSequenceJump = 10'000'000;
// A writer that is further ahead than this (50 days at 1 kHz) is ignored.
constexpr std::int64_t kMaxSequenceLeap = std::int64_t{1} << 32;
// Fast DDS also stores each number of a gap until all earlier samples have arrived. Writers only send gaps
// within their history, which is much shorter; heartbeats, which say where it begins, cover earlier samples.
constexpr std::int64_t kMaxGap = 100'000;

// An acknowledgement of a reader to a writer of this participant, which shows that the reader has
// found the writer.
struct Acknowledgement {
  std::array<std::uint8_t, 16> reader{};
  std::array<std::uint8_t, 4> writer{};  // its entity
  friend bool operator==(const Acknowledgement&, const Acknowledgement&) = default;
};

// One thread at a time.
class RtpsGuard {
 public:
  // False for what is no RTPS message or one that Fast DDS would read otherwise than this, for fragments of
  // nothing, of more than kMaxSampleBytes or without room for its list of them, for gaps that are wider than
  // kMaxGap together or end further than that from their writer's first available sample, and for sequence
  // numbers that leap ahead of their writer's earlier ones, unless its next heartbeat or sample confirms them
  // (after hours without connection); a repetition of the same datagram, as in a recording, does not.
  bool admits(std::span<const std::uint8_t> datagram);
  // Those in the last checked datagram, without an ACKNACK that a reader sends before it has information
  // about the writer's samples.
  [[nodiscard]] std::span<const Acknowledgement> acknowledgements() const { return acknowledgements_; }

 private:
  using Writer = std::array<std::uint8_t, 16>;
  // The progress that a writer announces: by a sample, or by a heartbeat with its count.
  struct Claim {
    std::int64_t sequence = 0;
    std::uint32_t heartbeat = 0;
    friend bool operator==(const Claim&, const Claim&) = default;
  };
  struct Progress {
    std::int64_t reached = 0;
    Claim leap;                   // the last one, if it was refused
    std::int64_t available = 1;   // the first sample that the writer still has, by its heartbeats
    std::uint32_t heartbeat = 0;  // the count of the last one
  };
  bool admits_submessage(std::uint8_t kind, std::uint8_t flags, std::span<const std::uint8_t> body,
                         Writer& writer);
  bool admits_claim(const Writer& writer, const Claim& claim);
  void note_available(const Writer& writer, std::int64_t first, std::int64_t last, std::uint32_t count);
  bool admits_gap(const Writer& writer, std::int64_t first, std::int64_t end);

  std::map<Writer, Progress> writers_;
  void note_acknowledgement(std::span<const std::uint8_t> body, bool little, const Writer& sender);

  std::int64_t gaps_ = 0;  // sequence numbers in the gaps of the present datagram
  std::vector<Acknowledgement> acknowledgements_;
};

}  // namespace doppel::ros2
