#include "doppel/ros/network/detail/rtps_guard.h"

#include <gtest/gtest.h>

#include <vector>

namespace doppel::ros2 {
namespace {

using Datagram = std::vector<std::uint8_t>;

Datagram rtps_header() {
  Datagram d{'R', 'T', 'P', 'S', 2, 3, 1, 15};
  d.resize(20);
  return d;
}

void append(Datagram& d, std::uint32_t value, int width) {
  for (int i = 0; i < width; ++i) d.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

struct Fragment {
  std::uint32_t first = 1, count = 1, size = 8, sample = 32, payload = 8;
};

Datagram with(const Fragment& f) {
  Datagram d = rtps_header();
  d.insert(d.end(), {0x16, 0x01});  // DATA_FRAG, little endian
  append(d, 32 + f.payload, 2);
  append(d, 0, 2);
  append(d, 28, 2);         // to the payload
  d.resize(d.size() + 16);  // reader, writer, sequence number
  append(d, f.first, 4);
  append(d, f.count, 2);
  append(d, f.size, 2);
  append(d, f.sample, 4);
  d.resize(d.size() + f.payload);
  return d;
}

struct Data {
  std::uint8_t flags = 0x07;  // little endian, inline QoS, data
  std::uint32_t offset = 16, parameter_size = 4, payload = 8;
};

Datagram with(const Data& data) {
  Datagram d = rtps_header();
  d.insert(d.end(), {0x15, data.flags});
  append(d, 20 + 8 + 4 + data.payload, 2);
  append(d, 0, 2);
  append(d, data.offset, 2);
  d.resize(d.size() + 16);
  append(d, 0x71, 2);  // a parameter of four bytes
  append(d, data.parameter_size, 2);
  append(d, 0, 4);
  append(d, 1, 4);  // the end of the list
  d.resize(d.size() + data.payload);
  return d;
}

TEST(RtpsGuard, ValidMessageIsAccepted) {
  EXPECT_TRUE(RtpsGuard().admits(rtps_header()));
  EXPECT_TRUE(RtpsGuard().admits(with(Fragment{})));
  EXPECT_TRUE(RtpsGuard().admits(with(Fragment{.first = 3, .count = 2, .sample = 29, .payload = 13})));
  EXPECT_TRUE(RtpsGuard().admits(with(Fragment{.first = 3, .count = 2, .sample = 29, .payload = 16})));
  EXPECT_TRUE(RtpsGuard().admits(with(Data{})));
  Datagram last = rtps_header();
  last.insert(last.end(), {0x0e, 0x01, 0, 0, 1, 2, 3});  // a length of zero: to the end
  EXPECT_TRUE(RtpsGuard().admits(last));
}

TEST(RtpsGuard, DataPartsBeyondWholeAreRefused) {
  EXPECT_FALSE(RtpsGuard().admits(with(Data{.offset = 0})));
  EXPECT_FALSE(RtpsGuard().admits(with(Data{.offset = 0x8000})));
  EXPECT_FALSE(RtpsGuard().admits(with(Data{.offset = 64})));
  EXPECT_FALSE(RtpsGuard().admits(with(Data{.parameter_size = 0xffff})));
  EXPECT_FALSE(RtpsGuard().admits(with(Data{.parameter_size = 12})));  // skips the end of the list
  EXPECT_FALSE(RtpsGuard().admits(with(Data{.payload = 0})));
}

TEST(RtpsGuard, InvalidMessageIsRefused) {
  EXPECT_FALSE(RtpsGuard().admits({}));
  EXPECT_FALSE(RtpsGuard().admits(Datagram(100, 0xff)));
  Datagram cut = with(Fragment{});
  cut.resize(cut.size() - 1);
  EXPECT_FALSE(RtpsGuard().admits(cut));
}

TEST(RtpsGuard, OversizedAndEmptyFragmentsAreRefused) {
  EXPECT_TRUE(RtpsGuard().admits(with(Fragment{.sample = kMaxSampleBytes})));
  for (const Fragment& f :
       {Fragment{.sample = kMaxSampleBytes + 1}, Fragment{.sample = 0xffffffff}, Fragment{.first = 0},
        Fragment{.count = 0}, Fragment{.size = 0}, Fragment{.first = 5}, Fragment{.first = 4, .count = 2},
        Fragment{.payload = 4}, Fragment{.payload = 16}})
    EXPECT_FALSE(RtpsGuard().admits(with(f)));
}

Datagram with_submessage(Datagram d, std::uint8_t kind, std::uint32_t size) {
  d.insert(d.end(), {kind, 0x01});
  append(d, size, 2);
  d.resize(d.size() + size);
  return d;
}

TEST(RtpsGuard, FastDdsStatisticsAreAcceptedAtEnd) {
  constexpr std::uint8_t kStatistics = 0x80, kPad = 0x01;
  constexpr std::uint32_t kSize = 56;
  const Datagram good = with_submessage(with(Data{}), kStatistics, kSize);
  EXPECT_TRUE(RtpsGuard().admits(good));
  EXPECT_FALSE(RtpsGuard().admits(with_submessage(good, kPad, 0)));
  EXPECT_FALSE(RtpsGuard().admits(with_submessage(good, kPad, 4)));
}

// Otherwise an invalid submessage could be hidden in what Fast DDS takes for the next one.
TEST(RtpsGuard, UnalignedSubmessageIsRefused) {
  constexpr std::uint8_t kPad = 0x01;
  EXPECT_TRUE(RtpsGuard().admits(with_submessage(with_submessage(rtps_header(), kPad, 4), kPad, 3)));
  EXPECT_FALSE(RtpsGuard().admits(with_submessage(with_submessage(rtps_header(), kPad, 3), kPad, 4)));
}

// HEARTBEAT and GAP both contain two sequence numbers and one more number: the heartbeat's count, and the
// number of bits after a gap.
void append_range(Datagram& d, std::uint8_t kind, std::int64_t first, std::int64_t second,
                  std::uint32_t number) {
  d.insert(d.end(), {kind, 0x01});
  append(d, 28, 2);
  append(d, 0, 4);           // reader
  append(d, 0x03010000, 4);  // writer
  for (const std::int64_t sequence : {first, second}) {
    append(d, static_cast<std::uint32_t>(sequence >> 32), 4);
    append(d, static_cast<std::uint32_t>(sequence), 4);
  }
  append(d, number, 4);
}

Datagram heartbeat(std::int64_t first, std::int64_t last, std::uint32_t count = 1) {
  Datagram d = rtps_header();
  append_range(d, 0x07, first, last, count);
  return d;
}

Datagram gap(std::int64_t first, std::int64_t end) {
  Datagram d = rtps_header();
  append_range(d, 0x08, first, end, 0);
  return d;
}

Datagram acknowledgement(std::uint32_t base) {
  Datagram d = rtps_header();
  for (std::uint8_t i = 8; i < 20; ++i) d[i] = i;
  d.insert(d.end(), {0x06, 0x01, 24, 0});
  d.insert(d.end(), {0, 0, 18, 4, 0, 0, 17, 3});  // the reader, the writer
  append(d, 0, 4);
  append(d, base, 4);
  append(d, 0, 4);  // the number of bits that follow
  append(d, 1, 4);  // the count of the acknowledgement
  return d;
}

TEST(RtpsGuard, AcknowledgementsAreReported) {
  RtpsGuard guard;
  ASSERT_TRUE(guard.admits(acknowledgement(7)));
  const Acknowledgement expected{{8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 0, 0, 18, 4}, {0, 0, 17, 3}};
  ASSERT_EQ(guard.acknowledgements().size(), 1u);
  EXPECT_EQ(guard.acknowledgements()[0], expected);
  ASSERT_TRUE(guard.admits(acknowledgement(0)));
  EXPECT_TRUE(guard.acknowledgements().empty())
      << "expected none: the reader has not received any of the writer's samples";
  ASSERT_TRUE(guard.admits(rtps_header()));
  EXPECT_TRUE(guard.acknowledgements().empty());
}

TEST(RtpsGuard, UnclaimedSequenceLeapIsRefused) {
  RtpsGuard guard;
  EXPECT_TRUE(guard.admits(heartbeat(1, 10)));
  EXPECT_FALSE(guard.admits(heartbeat(std::int64_t{5} << 32, 10)));
  EXPECT_FALSE(guard.admits(heartbeat(1, std::int64_t{1} << 62)));
  EXPECT_FALSE(guard.admits(heartbeat(-1, -1)));
  EXPECT_TRUE(guard.admits(heartbeat(2, 11)));
  EXPECT_FALSE(guard.admits(heartbeat(1, 2'000'000'000, 2)));
  EXPECT_FALSE(guard.admits(heartbeat(1, 2'000'000'000, 2)));  // a duplicated packet
  EXPECT_TRUE(guard.admits(heartbeat(1, 2'000'000'000, 3)));   // the writer repeats it
  EXPECT_TRUE(guard.admits(heartbeat(1, 2'000'000'002, 4)));
  for (std::uint32_t count = 5; count < 8; ++count)
    EXPECT_FALSE(guard.admits(heartbeat(1, 2 * kMaxSequenceLeap, count)));
}

TEST(RtpsGuard, WideGapIsRefused) {
  RtpsGuard guard;
  EXPECT_TRUE(guard.admits(gap(1, 1 + kMaxGap)));
  for (int times = 0; times < 3; ++times) EXPECT_FALSE(guard.admits(gap(3, 4 + kMaxGap)));
  Datagram many = gap(1, kMaxGap);
  append_range(many, 0x08, kMaxGap, kMaxGap + 10, 0);
  EXPECT_FALSE(guard.admits(many));
}

TEST(RtpsGuard, DistantGapIsRefused) {
  constexpr std::int64_t kFar = 2 * kMaxSequenceJump;
  RtpsGuard guard;
  for (int times = 0; times < 3; ++times) EXPECT_FALSE(guard.admits(gap(kFar, kFar + 1)));
  EXPECT_FALSE(guard.admits(heartbeat(1, kFar, 1)));
  EXPECT_FALSE(guard.admits(gap(kFar, kFar + 1)));
  EXPECT_TRUE(guard.admits(heartbeat(1, kFar, 2)));
  EXPECT_FALSE(guard.admits(gap(kFar, kFar + 1))) << "the first sample is still available, far below";
  EXPECT_TRUE(guard.admits(heartbeat(kFar - 5, kFar, 3)));
  EXPECT_TRUE(guard.admits(gap(kFar, kFar + 1)));
}

// Fast DDS ignores such heartbeats, so that the numbers of gaps would accumulate in it.
TEST(RtpsGuard, RepeatedOrImpossibleHeartbeatDoesNotAllowDistantGap) {
  constexpr std::int64_t kFar = 3 * kMaxGap;
  RtpsGuard guard;
  EXPECT_TRUE(guard.admits(heartbeat(1, kFar, 5)));
  EXPECT_TRUE(guard.admits(heartbeat(kFar, kFar, 5)));
  EXPECT_TRUE(guard.admits(heartbeat(kFar, kFar - 2, 6)));
  EXPECT_FALSE(guard.admits(gap(kFar, kFar + 1)));
}

// INFO_SRC names another sender for what follows: its gaps do not profit from the heartbeats of the header's.
TEST(RtpsGuard, ProgressBelongsToSenderOfInfoSource) {
  constexpr std::int64_t kFar = 3 * kMaxGap;
  RtpsGuard guard;
  ASSERT_TRUE(guard.admits(heartbeat(kFar, kFar, 1)));
  Datagram other = rtps_header();
  other.insert(other.end(), {0x0c, 0x01, 20, 0});
  other.resize(other.size() + 8);
  other.resize(other.size() + 12, 0x77);
  Datagram short_source = other;
  append_range(other, 0x08, kFar, kFar + 1, 0);
  EXPECT_TRUE(guard.admits(gap(kFar, kFar + 1)));
  EXPECT_FALSE(guard.admits(other));
  short_source.resize(short_source.size() - 4);
  short_source[22] = 16;
  EXPECT_FALSE(guard.admits(short_source));
}

Datagram of_sender(std::uint32_t sender, Datagram d) {
  for (std::size_t i = 0; i < 4; ++i) d[8 + i] = static_cast<std::uint8_t>(sender >> (8 * i));
  return d;
}

TEST(RtpsGuard, WritersBeyondTheirNumberLetAllBeForgotten) {
  constexpr std::uint32_t kMaxWriters = 10'000;
  constexpr std::int64_t kFar = 3 * kMaxGap;
  RtpsGuard guard;
  ASSERT_TRUE(guard.admits(heartbeat(kFar, kFar, 1)));
  for (std::uint32_t sender = 1; sender < kMaxWriters; ++sender)
    ASSERT_TRUE(guard.admits(of_sender(sender, heartbeat(1, 1))));
  EXPECT_TRUE(guard.admits(gap(kFar, kFar + 1)));
  ASSERT_TRUE(guard.admits(of_sender(kMaxWriters, heartbeat(1, 1))));
  EXPECT_FALSE(guard.admits(gap(kFar, kFar + 1))) << "expected the writer's heartbeat to be forgotten";
  EXPECT_TRUE(guard.admits(heartbeat(kFar, kFar, 2)));
  EXPECT_TRUE(guard.admits(gap(kFar, kFar + 1)));
}

// CVE-2025-62799: Fast DDS keeps its list of missing fragments in the sample.
TEST(RtpsGuard, FragmentsWithoutRoomForListOfThemAreRefused) {
  EXPECT_TRUE(RtpsGuard().admits(with(Fragment{.sample = 28})));
  EXPECT_FALSE(RtpsGuard().admits(with(Fragment{.sample = 27})));
  EXPECT_FALSE(RtpsGuard().admits(with(Fragment{.size = 3, .sample = 32, .payload = 3})));
  EXPECT_TRUE(RtpsGuard().admits(with(Fragment{.size = 3, .sample = 3, .payload = 3})));
}

}  // namespace
}  // namespace doppel::ros2
