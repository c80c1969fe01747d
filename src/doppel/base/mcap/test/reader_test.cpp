// Reading by index and by scan, files that end too early, and damage.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/mcap/detail/compression.h"
#include "doppel/base/mcap/mcap_reader.h"
#include "doppel/base/mcap/test/memory_sink.h"

namespace doppel {
namespace {

using mcap_testing::bytes_of;
using mcap_testing::MemorySink;
using testing::HasSubstr;

constexpr std::uint64_t kSecond = 1'000'000'000;

struct Sent {
  std::uint16_t channel = 0;
  std::uint64_t time = 0;
  std::string data;
  bool operator==(const Sent&) const = default;
};

// Three topics whose times run back and forth by up to a second, in small chunks.
struct RandomBag {
  std::vector<Sent> sent;  // in the order of the file
  std::vector<std::byte> file;
  std::vector<std::uint64_t> flushed;  // sizes of the file after each chunk

  explicit RandomBag(const std::string& compression, std::size_t chunk_size = 2000, bool close = true) {
    std::mt19937 random(81);
    MemorySink sink;
    McapWriterOptions options;
    options.compression = compression;
    options.chunk_size = chunk_size;
    McapWriter writer(sink, options);
    const auto schema = writer.add_schema("std_msgs/msg/String", "ros2msg", bytes_of("string data\n"));
    for (const char* topic : {"/a", "/b", "/c"})
      writer.add_channel(schema, topic, "cdr", {{"offered_qos_profiles", ""}});
    for (std::uint32_t i = 0; i < 1000; ++i) {
      Sent one{static_cast<std::uint16_t>(1 + random() % 3), i * kSecond / 100 + random() % kSecond,
               std::string(random() % 40, static_cast<char>('a' + random() % 26))};
      writer.write({one.channel, i, one.time, one.time, bytes_of(one.data)});
      sent.push_back(std::move(one));
      if (flushed.empty() || sink.bytes.size() != flushed.back()) flushed.push_back(sink.bytes.size());
    }
    writer.attach({7, 8, "arm.urdf", "application/xml", bytes_of("<robot/>")});
    writer.add_metadata("doppel", {{"seed", "7"}});
    if (close) writer.close();
    file = std::move(sink.bytes);
  }

  [[nodiscard]] std::vector<Sent> by_time(const McapRange& range) const {
    std::vector<Sent> out;
    for (const Sent& one : sent) {
      const bool is_chosen =
          range.channels.empty() || std::ranges::find(range.channels, one.channel) != range.channels.end();
      if (is_chosen && one.time >= range.start && one.time < range.end) out.push_back(one);
    }
    std::ranges::stable_sort(out, {}, &Sent::time);
    return out;
  }
};

std::vector<Sent> read_all(McapReader& reader, const McapRange& range) {
  std::vector<Sent> out;
  reader.seek(range);
  while (const auto message = reader.next()) {
    const auto* const text = reinterpret_cast<const char*>(message->data.data());
    out.push_back({message->channel_id, message->log_time, std::string(text, message->data.size())});
  }
  return out;
}

TEST(McapReader, MessagesComeByTimeWithinRangeAndChannels) {
  SCOPED_TRACE("seed 81");
  for (const std::string compression : {"zstd", "lz4", ""}) {
    for (const std::size_t chunk_size : {std::size_t{2000}, std::size_t{0}}) {
      const RandomBag bag(compression, chunk_size);
      McapReader reader(mcap_source(bag.file));
      EXPECT_EQ(reader.contents().indexed, chunk_size > 0);
      EXPECT_EQ(reader.contents().message_count, 1000u);
      EXPECT_EQ(reader.contents().channels.size(), 3u);
      for (const McapRange& range :
           {McapRange{}, McapRange{3 * kSecond, 5 * kSecond}, McapRange{0, UINT64_MAX, {2}},
            McapRange{kSecond, 2 * kSecond, {1, 3}}, McapRange{50 * kSecond, 60 * kSecond}}) {
        ASSERT_EQ(read_all(reader, range), bag.by_time(range));
      }
    }
  }
}

TEST(McapReader, SummaryAndScanAreEqual) {
  const RandomBag bag("zstd");
  const RandomBag open("zstd", 2000, false);
  McapReader closed(mcap_source(bag.file)), scanned(mcap_source(open.file));
  const McapContents &a = closed.contents(), &b = scanned.contents();
  EXPECT_TRUE(a.indexed);
  EXPECT_FALSE(b.indexed);
  EXPECT_EQ(b.damage, "");
  EXPECT_EQ(a.message_count, b.message_count);
  EXPECT_EQ(a.start_time, b.start_time);
  EXPECT_EQ(a.end_time, b.end_time);
  EXPECT_EQ(a.profile, "ros2");
  EXPECT_EQ(b.profile, "ros2");
  ASSERT_EQ(a.chunks.size(), b.chunks.size());
  for (std::size_t i = 0; i < a.chunks.size(); ++i) {
    EXPECT_EQ(a.chunks[i].offset, b.chunks[i].offset);
    EXPECT_EQ(a.chunks[i].end_time, b.chunks[i].end_time);
  }
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(a.channels[i].message_count, b.channels[i].message_count);
  ASSERT_EQ(a.attachments.size(), 1u);
  const McapRecord part = closed.part(a.attachments[0]);
  EXPECT_EQ(std::get<McapAttachment>(part).name, "arm.urdf");
  ASSERT_EQ(b.metadata.size(), 1u);
  const McapRecord texts = scanned.part(b.metadata[0]);
  EXPECT_EQ(std::get<McapMetadata>(texts).texts.at(0).second, "7");
}

// Behaviour 43: of a file that ends anywhere, everything before the chunk that is cut is read.
TEST(McapReader, FileThatEndsAnywhereGivesAllWholeChunks) {
  const RandomBag bag("zstd", 2000, false);
  for (std::size_t size = kMcapMagicSize; size < bag.file.size(); size += 37) {
    std::vector<std::byte> cut(bag.file.begin(), bag.file.begin() + static_cast<std::ptrdiff_t>(size));
    McapReader reader(mcap_source(cut));
    const auto whole = std::ranges::count_if(bag.flushed, [&](std::uint64_t end) { return end <= size; });
    ASSERT_GE(reader.contents().chunks.size() + 1, static_cast<std::size_t>(whole)) << size;
    ASSERT_LE(reader.contents().whole, size);
    std::size_t count = 0;
    while (reader.next()) ++count;
    ASSERT_EQ(count, reader.contents().message_count) << size;
  }
}

// Behaviour 49: damage names the byte, and nothing is read beyond the file or reserved for it.
TEST(McapReader, DamagedByteIsReportedOrHarmless) {
  SCOPED_TRACE("seed 82");
  const RandomBag bag("lz4");
  std::mt19937 random(82);
  int reported = 0;
  for (int round = 0; round < 3000; ++round) {
    std::vector<std::byte> file = bag.file;
    for (unsigned k = 0; k <= random() % 3; ++k)
      file[random() % file.size()] ^= static_cast<std::byte>(1U << random() % 8);
    try {
      McapReader reader(mcap_source(file));
      while (reader.next()) {
      }
      reported += reader.contents().damage.empty() ? 0 : 1;
    } catch (const InputError& problem) {
      EXPECT_THAT(problem.what(), HasSubstr("mcap."));
      ++reported;
    }
  }
  EXPECT_GT(reported, 2000);
}

std::string refusal(const std::vector<std::byte>& file) {
  try {
    McapReader reader(mcap_source(file));
    return reader.contents().damage;
  } catch (const InputError& problem) {
    return problem.what();
  }
}

TEST(McapReader, OtherFilesAreNamed) {
  EXPECT_THAT(refusal({}), HasSubstr("the file is empty"));
  EXPECT_THAT(refusal(bytes_of("SQLite format 3\0 and more")), HasSubstr("SQLite bag of rosbag2"));
  EXPECT_THAT(refusal(bytes_of("#ROSBAG V2.0\n")), HasSubstr("bag of ROS 1"));
  EXPECT_THAT(refusal(bytes_of("<robot name=\"arm\"/>")), HasSubstr("does not begin as an MCAP file"));
}

TEST(McapReader, HugeLengthIsReportedWithItsByte) {
  RandomBag bag("zstd", 2000, false);
  const std::uint64_t huge = std::uint64_t{1} << 63U;
  std::memcpy(&bag.file[kMcapMagicSize + 1], &huge, sizeof huge);
  EXPECT_THAT(refusal(bag.file), HasSubstr("the record at byte 8 is said to have 9223372036854775808 bytes"));
}

TEST(McapCompression, UnknownNameAndDamageAreRefused) {
  std::vector<std::byte> out;
  EXPECT_THROW(compress("zst", 0, bytes_of("x"), out), InputError);
  for (const char* name : {"zstd", "lz4"}) {
    out.clear();
    const std::vector<std::byte> text = bytes_of(std::string(5000, 'x') + "end");
    compress(name, 0, text, out);
    EXPECT_LT(out.size(), 200u);
    EXPECT_EQ(decompress(name, out, text.size()), text);
    EXPECT_THROW((void)decompress(name, out, text.size() - 1), InputError);
    EXPECT_THROW((void)decompress(name, out, text.size() + 1), InputError);
    EXPECT_THROW((void)decompress(name, std::span(out).first(out.size() - 1), text.size()), InputError);
    EXPECT_THROW((void)decompress(name, bytes_of("no frame"), 10), InputError);
    EXPECT_THROW((void)decompress(name, out, std::size_t{1} << 40U), InputError) << "no memory is reserved";
  }
}

// Values of the check "123456789" of CRC-32, in one piece and in two.
TEST(McapCrc, EqualsPublishedCheckValue) {
  const std::vector<std::byte> digits = bytes_of("123456789");
  EXPECT_EQ(mcap_crc(digits), 0xCBF43926U);
  EXPECT_EQ(mcap_crc(std::span(digits).subspan(4), mcap_crc(std::span(digits).first(4))), 0xCBF43926U);
}

}  // namespace
}  // namespace doppel
