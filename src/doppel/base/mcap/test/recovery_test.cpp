// Behaviours 43 and 44 of the specification: what is left of files that were cut, or damaged within.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/mcap/mcap_reader.h"
#include "doppel/base/mcap/mcap_recovery.h"
#include "doppel/base/mcap/test/memory_sink.h"

namespace doppel {
namespace {

using mcap_testing::bytes_of;
using mcap_testing::MemorySink;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

McapWriterOptions small_chunks(const std::string& compression = "zstd") {
  McapWriterOptions out;
  out.compression = compression;
  out.chunk_size = 1000;
  return out;
}

// 500 numbered messages of two topics.
std::vector<std::byte> make_bag(bool close, const std::string& compression = "zstd") {
  MemorySink sink;
  McapWriter writer(sink, small_chunks(compression));
  const auto schema = writer.add_schema("std_msgs/msg/UInt32", "ros2msg", bytes_of("uint32 data\n"));
  for (const char* topic : {"/a", "/b"}) writer.add_channel(schema, topic, "cdr", {});
  writer.add_metadata("rosbag2", {{"serialized_metadata", "x"}});
  for (std::uint32_t i = 0; i < 500; ++i)
    writer.write({static_cast<std::uint16_t>(1 + i % 2), i, i, i,
                  bytes_of(std::to_string(i) + " twenty bytes of it")});
  if (close) writer.close();
  return std::move(sink.bytes);
}

std::vector<std::byte> recovered(const std::vector<std::byte>& file, McapRecovery& about) {
  MemorySink sink;
  about = recover_mcap(*mcap_source(file), sink, small_chunks());
  return std::move(sink.bytes);
}

std::vector<std::uint32_t> sequences(const std::vector<std::byte>& file) {
  McapReader reader(mcap_source(file), false);
  EXPECT_TRUE(reader.contents().indexed);
  std::vector<std::uint32_t> out;
  while (const auto message = reader.next()) out.push_back(message->sequence);
  return out;
}

TEST(McapRecovery, FileThatWasNotClosedLosesOnlyItsLastChunk) {
  const std::vector<std::byte> whole = make_bag(true), open = make_bag(false);
  for (std::size_t size = 200; size < open.size(); size += 101) {
    McapRecovery about;
    const std::vector<std::byte> copy =
        recovered({open.begin(), open.begin() + static_cast<std::ptrdiff_t>(size)}, about);
    const std::vector<std::uint32_t> kept = sequences(copy);
    ASSERT_EQ(kept.size(), about.messages);
    for (std::size_t i = 0; i < kept.size(); ++i) ASSERT_EQ(kept[i], i);
    ASSERT_THAT(check_mcap(*mcap_source(copy)).problems, IsEmpty());
  }
  McapRecovery about;
  EXPECT_EQ(sequences(recovered(whole, about)).size(), 500u);
  EXPECT_THAT(about.losses, IsEmpty());
}

TEST(McapRecovery, RecoveringTwiceGivesEqualBytes) {
  std::vector<std::byte> file = make_bag(true);
  file[file.size() / 2] ^= std::byte{1};
  McapRecovery about;
  const std::vector<std::byte> once = recovered(file, about);
  EXPECT_EQ(recovered(once, about), once);
  EXPECT_THAT(about.losses, IsEmpty());
}

TEST(McapRecovery, MessagesBehindDamagedLengthAreFoundAgain) {
  for (const std::string compression : {"zstd", "lz4", ""}) {
    std::vector<std::byte> file = make_bag(true, compression);
    McapReader reader(mcap_source(file));
    const std::vector<McapChunkInfo> chunks = reader.contents().chunks;
    ASSERT_GT(chunks.size(), 10u);
    file[chunks[5].offset + 4] ^= std::byte{0x40};  // its length is now beyond the file
    McapRecovery about;
    const std::vector<std::uint32_t> kept = sequences(recovered(file, about));
    EXPECT_THAT(about.losses,
                ElementsAre(HasSubstr("the record at byte " + std::to_string(chunks[5].offset))));
    EXPECT_EQ(kept.back(), 499u) << compression;
    EXPECT_GT(kept.size(), 450u);
    EXPECT_LT(kept.size(), 500u);
    EXPECT_GT(about.damaged_bytes, chunks[5].length - 1);
  }
}

TEST(McapCheck, EveryKindOfDamageIsNamed) {
  const std::vector<std::byte> file = make_bag(true);
  EXPECT_THAT(check_mcap(*mcap_source(file)).problems, IsEmpty());
  EXPECT_EQ(check_mcap(*mcap_source(file)).messages, 500u);
  EXPECT_THAT(check_mcap(*mcap_source(make_bag(false))).problems,
              ElementsAre(HasSubstr("it was not closed")));
  McapReader reader(mcap_source(file));
  const std::vector<McapChunkInfo> chunks = reader.contents().chunks;
  std::vector<std::byte> damaged = file;
  damaged[chunks[2].offset + chunks[2].length - 20] ^= std::byte{2};
  EXPECT_THAT(check_mcap(*mcap_source(damaged)).problems,
              testing::Contains(HasSubstr("the chunk at byte " + std::to_string(chunks[2].offset))));
  damaged = file;
  damaged[damaged.size() - 60] ^= std::byte{4};  // in the summary
  EXPECT_THAT(check_mcap(*mcap_source(damaged)).problems, testing::Not(IsEmpty()));
  damaged = file;
  damaged.resize(damaged.size() - 1);
  EXPECT_THAT(check_mcap(*mcap_source(damaged)).problems, testing::Not(IsEmpty()));
}

}  // namespace
}  // namespace doppel
