#include "doppel/ros/network/detail/rtps_gap.h"

#include <gtest/gtest.h>

namespace doppel::ros2 {
namespace {

using Datagram = std::vector<std::uint8_t>;

constexpr std::array<std::uint8_t, 4> kWriter{0, 0, 17, 3}, kOther{0, 0, 18, 3};

Datagram any_header() {
  return Datagram(20, 0xEE);
}

void append(Datagram& d, const Datagram& bytes) {
  d.insert(d.end(), bytes.begin(), bytes.end());
}

const Datagram kTimestamp{0x09, 0x01, 8, 0, 1, 2, 3, 4, 5, 6, 7, 8};
// The writer's sample 0xffffffff, after which the upper half of the number changes.
const Datagram kData{0x15, 0x05, 24, 0, 0, 0, 16,   0,    0,    0,    0, 0, 0, 0,
                     17,   3,    0,  0, 0, 0, 0xff, 0xff, 0xff, 0xff, 9, 9, 9, 9};
const Datagram kGap{0x08, 0x01, 28,   0,    0, 0, 0, 0, 0, 0, 17, 3, 0, 0, 0, 0,
                    0xff, 0xff, 0xff, 0xff, 1, 0, 0, 0, 0, 0, 0,  0, 0, 0, 0, 0};

TEST(RtpsGap, GapReplacesSampleOfWriter) {
  Datagram sent = any_header(), expected = any_header();
  for (const Datagram& part : {kTimestamp, kData, kTimestamp}) append(sent, part);
  for (const Datagram& part : {kTimestamp, kGap, kTimestamp}) append(expected, part);
  EXPECT_EQ(without_samples(sent, kWriter), expected);
}

TEST(RtpsGap, OtherSamplesGiveNoGap) {
  Datagram sent = any_header();
  append(sent, kData);
  EXPECT_TRUE(without_samples(sent, kOther).empty());
  EXPECT_TRUE(without_samples(any_header(), kWriter).empty());
  sent.pop_back();
  EXPECT_TRUE(without_samples(sent, kWriter).empty()) << "expected no gap for a truncated submessage";
  EXPECT_TRUE(without_samples({}, kWriter).empty());
}

}  // namespace
}  // namespace doppel::ros2
