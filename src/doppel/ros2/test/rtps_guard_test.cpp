#include "doppel/ros2/rtps_guard.h"

#include <gtest/gtest.h>

#include <vector>

namespace doppel::ros2 {
namespace {

using Datagram = std::vector<std::uint8_t>;

Datagram header() {
  Datagram d{'R', 'T', 'P', 'S', 2, 3, 1, 15};
  d.resize(20);
  return d;
}

void append(Datagram& d, std::uint32_t value, int width) {
  for (int i = 0; i < width; ++i) d.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

struct Fragment {
  std::uint32_t first = 1, count = 1, size = 1024, sample = 4096;
};

Datagram with(const Fragment& f) {
  Datagram d = header();
  d.insert(d.end(), {0x16, 0x01});  // DATA_FRAG, little endian
  append(d, 36, 2);
  append(d, 0, 4);          // flags, offset to the inline QoS
  d.resize(d.size() + 16);  // reader, writer, sequence number
  append(d, f.first, 4);
  append(d, f.count, 2);
  append(d, f.size, 2);
  append(d, f.sample, 4);
  append(d, 0, 4);
  return d;
}

TEST(RtpsGuard, TakesWhatIsAMessage) {
  EXPECT_TRUE(is_acceptable(header()));
  EXPECT_TRUE(is_acceptable(with({})));
  Datagram last = header();
  last.insert(last.end(), {0x15, 0x01, 0, 0, 1, 2, 3});  // a length of zero: to the end
  EXPECT_TRUE(is_acceptable(last));
}

TEST(RtpsGuard, RefusesWhatIsNone) {
  EXPECT_FALSE(is_acceptable({}));
  EXPECT_FALSE(is_acceptable(Datagram(100, 0xff)));
  Datagram cut = with({});
  cut.resize(cut.size() - 1);
  EXPECT_FALSE(is_acceptable(cut));
}

TEST(RtpsGuard, RefusesFragmentsThatAskForTooMuchOrAreNone) {
  EXPECT_TRUE(is_acceptable(with({.sample = kLargestSample})));
  EXPECT_FALSE(is_acceptable(with({.sample = kLargestSample + 1})));
  EXPECT_FALSE(is_acceptable(with({.sample = 0xffffffff})));
  EXPECT_FALSE(is_acceptable(with({.first = 0})));
  EXPECT_FALSE(is_acceptable(with({.count = 0})));
  EXPECT_FALSE(is_acceptable(with({.size = 0})));
}

}  // namespace
}  // namespace doppel::ros2
