#pragma once
// A look at datagrams before Fast DDS believes them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace doppel::ros2 {

// Memory for a whole sample is taken when its first fragment comes, on the word of whoever sent it.
constexpr std::uint32_t kMaxSampleBytes = 64u * 1024 * 1024;
// Fast DDS counts through all sequence numbers that a heartbeat or a gap leaves out, five million a second,
// with the reader locked and the port unread: one packet of nonsense would stop it for hours.
constexpr std::int64_t kMaxSequenceJump = 10'000'000;
// Of a writer that has sent this much more (50 days at 1 kHz) nothing is heard, but all others are.
constexpr std::int64_t kMaxSequenceLeap = std::int64_t{1} << 32;
// And it remembers each number of a gap until all before it have come. Writers tell of gaps in their history,
// which is shorter by far; of what lies before it their heartbeats tell.
constexpr std::int64_t kMaxGap = 100'000;

// What a reader has said to a writer of the participant that it was sent to: it knows how far that one is.
struct Acknowledgement {
  std::array<std::uint8_t, 16> reader{};
  std::array<std::uint8_t, 4> writer{};  // its entity
  friend bool operator==(const Acknowledgement&, const Acknowledgement&) = default;
};

// One thread at a time.
class RtpsGuard {
 public:
  // False for what is no RTPS message or one that Fast DDS would read otherwise than this, for fragments of
  // nothing or of more than kMaxSampleBytes, for gaps that are wider than kMaxGap together, and for
  // sequence numbers that leap ahead of what their writer has sent before, unless its next heartbeat or
  // sample says so, too (it has been out of reach for hours): the same once more, as of a recording, is not
  // enough.
  bool admits(std::span<const std::uint8_t> datagram);
  // Those in the datagram that was looked at last. What a reader sends before it has heard of the writer's
  // samples is none.
  [[nodiscard]] std::span<const Acknowledgement> acknowledgements() const { return acknowledgements_; }

 private:
  using Writer = std::array<std::uint8_t, 16>;
  // How far a writer says that it is: at a sample, or in its how-manieth heartbeat.
  struct Claim {
    std::int64_t sequence = 0;
    std::uint32_t heartbeat = 0;
    friend bool operator==(const Claim&, const Claim&) = default;
  };
  struct Progress {
    std::int64_t reached = 0;
    Claim leap;  // the last one, if it was refused
  };
  bool admits_submessage(std::uint8_t kind, std::uint8_t flags, std::span<const std::uint8_t> body,
                         Writer& writer);
  bool admits_claim(const Writer& writer, const Claim& claim);
  bool admits_gap(const Writer& writer, std::int64_t first, std::int64_t end);

  std::map<Writer, Progress> writers_;
  void note_acknowledgement(std::span<const std::uint8_t> body, bool little, const Writer& sender);

  std::int64_t gaps_ = 0;  // numbers in those of the datagram that is looked at
  std::vector<Acknowledgement> acknowledgements_;
};

}  // namespace doppel::ros2
