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

// A file of these records and of messages of channel 1, without chunks and summary.
std::vector<std::byte> file_of(const std::vector<McapRecord>& records) {
  std::vector<std::byte> out;
  for (const unsigned char byte : kMcapMagic) out.push_back(std::byte{byte});
  append_record(McapHeader{"ros2", "test"}, out);
  for (const McapRecord& record : records) append_record(record, out);
  append_record(McapMessage{1, 1, 5, 5, {}}, out);
  append_record(McapDataEnd{}, out);
  append_record(McapFooter{}, out);
  for (const unsigned char byte : kMcapMagic) out.push_back(std::byte{byte});
  return out;
}

std::vector<std::string> problems_of(const std::vector<McapRecord>& records) {
  return check_mcap(*mcap_source(file_of(records))).problems;
}

TEST(McapCheck, DefinitionsThatContradictEachOtherAreNamed) {
  const McapSchema schema{1, "std_msgs/msg/String", "ros2msg", {}};
  const McapChannel channel{1, 1, "/a", "cdr", {}};
  EXPECT_THAT(problems_of({schema, channel, schema, channel}), IsEmpty()) << "repeated as it was";
  EXPECT_THAT(problems_of({McapChannel{1, 0, "/a", "json", {}}}), IsEmpty()) << "without a schema";
  EXPECT_THAT(problems_of({channel}),
              ElementsAre(HasSubstr("is of schema 1, which is not described before it")));
  EXPECT_THAT(problems_of({schema, channel, McapChannel{1, 1, "/b", "cdr", {}}}),
              ElementsAre(HasSubstr("the channel 1 ('/b')")));
  EXPECT_THAT(problems_of({schema, McapSchema{1, "std_msgs/msg/Bool", "ros2msg", {}}, channel}),
              ElementsAre(HasSubstr("the schema 1 ('std_msgs/msg/Bool')")));
  EXPECT_THAT(problems_of({McapSchema{0, "a", "ros2msg", {}}, schema, channel}),
              ElementsAre(HasSubstr("the schema 'a' at byte 33 has the number 0")));
}

TEST(McapCheck, MessageIndexOfOtherMessagesIsNamed) {
  std::vector<std::byte> records;
  append_record(McapChannel{1, 0, "/a", "json", {}}, records);
  const std::uint64_t place = records.size();
  append_record(McapMessage{1, 1, 7, 7, {}}, records);
  const McapChunk chunk{7, 7, records.size(), mcap_crc(records), "", records};
  EXPECT_THAT(problems_of({chunk, McapMessageIndex{1, {{7, place}}}}), IsEmpty());
  const auto wrong = ElementsAre(HasSubstr("the message index of channel 1"));
  EXPECT_THAT(problems_of({chunk, McapMessageIndex{1, {{8, place}}}}), wrong);
  EXPECT_THAT(problems_of({chunk, McapMessageIndex{1, {{7, place + 1}}}}), wrong);
  EXPECT_THAT(problems_of({chunk, McapMessageIndex{1, {}}}), wrong);
  EXPECT_THAT(problems_of({chunk, McapMessageIndex{2, {{7, place}}}}),
              ElementsAre(HasSubstr("the message index of channel 2")));
}

}  // namespace
}  // namespace doppel
