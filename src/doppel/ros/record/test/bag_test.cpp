// Bags: folders with their metadata, split files, latched messages, and the way back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/ros/record/bag_writer.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::uint64_t kSecond = 1'000'000'000;

class BagTest : public testing::Test {
 protected:
  BagTest() { fs::remove_all(folder_); }
  ~BagTest() override { fs::remove_all(folder_); }

  static RecordedTopic topic(const std::string& name, bool latched = false) {
    RecordedTopic out;
    out.name = name;
    out.type = std_msgs::msg::String::kType;
    out.schema = find_type(out.type)->schema();
    out.type_hash = find_type(out.type)->hash();
    out.qos = offered_qos_text({{.depth = 3, .latched = latched}});
    out.latched = latched ? 3 : 0;
    return out;
  }
  static Bytes text(const std::string& data) { return to_cdr(std_msgs::msg::String{data}); }
  BagWriterOptions options() const {
    BagWriterOptions out;
    out.folder = folder_;
    return out;
  }
  std::string file_text(const std::string& name) const {
    std::ifstream in(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::vector<std::string> read(std::uint64_t start = 0, std::uint64_t end = UINT64_MAX,
                                const TopicSelection& topics = {}) const {
    BagReader reader(folder_.string());
    reader.seek(start, end, topics);
    std::vector<std::string> out;
    while (const auto message = reader.next()) {
      std_msgs::msg::String value;
      EXPECT_TRUE(from_cdr(message->data, value));
      out.push_back(std::to_string(message->log_time / kSecond) + value.data);
    }
    return out;
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("bag_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(BagTest, MetadataHasEveryFieldOfRosbag2Version9) {
  BagWriter writer(options());
  const std::size_t a = writer.add_topic(topic("/a"));
  writer.write(a, 1, 2 * kSecond, 2 * kSecond, text("x"));
  writer.write(a, 2, 5 * kSecond, 5 * kSecond, text("y"));
  writer.close();
  const std::string stem = folder_.filename().string();
  EXPECT_EQ(
      file_text("metadata.yaml"),
      "rosbag2_bagfile_information:\n"
      "  version: 9\n"
      "  storage_identifier: mcap\n"
      "  duration:\n    nanoseconds: 3000000000\n"
      "  starting_time:\n    nanoseconds_since_epoch: 2000000000\n"
      "  message_count: 2\n"
      "  topics_with_message_count:\n"
      "    - topic_metadata:\n"
      "        name: \"/a\"\n"
      "        type: \"std_msgs/msg/String\"\n"
      "        serialization_format: cdr\n"
      "        offered_qos_profiles:\n"
      "          - history: keep_last\n"
      "            depth: 3\n"
      "            reliability: reliable\n"
      "            durability: volatile\n"
      "            deadline:\n              sec: 9223372036\n              nsec: 854775807\n"
      "            lifespan:\n              sec: 9223372036\n              nsec: 854775807\n"
      "            liveliness: automatic\n"
      "            liveliness_lease_duration:\n              sec: 9223372036\n              nsec: 854775807\n"
      "            avoid_ros_namespace_conventions: false\n"
      "        type_description_hash: " +
          find_type("std_msgs/msg/String")->hash() +
          "\n"
          "      message_count: 2\n"
          "  compression_format: \"\"\n  compression_mode: \"\"\n"
          "  relative_file_paths:\n    - \"" +
          stem +
          "_0.mcap\"\n"
          "  files:\n    - path: \"" +
          stem +
          "_0.mcap\"\n"
          "      starting_time:\n        nanoseconds_since_epoch: 2000000000\n"
          "      duration:\n        nanoseconds: 3000000000\n"
          "      message_count: 2\n"
          "  custom_data: ~\n"
          "  ros_distro: jazzy\n");
}

TEST_F(BagTest, EverySplitBeginsWithLatchedMessagesAndReaderGivesThemOnce) {
  BagWriterOptions split = options();
  split.max_file_time = std::chrono::seconds(2);
  BagWriter writer(split);
  const std::size_t latched = writer.add_topic(topic("/robot_description", true));
  const std::size_t a = writer.add_topic(topic("/a"));
  writer.write(latched, 1, 0, 0, text("arm"));
  for (std::uint64_t t = 1; t < 7; ++t)
    writer.write(a, static_cast<std::uint32_t>(t), t * kSecond, t * kSecond, text("a"));
  writer.close();
  ASSERT_EQ(writer.metadata().files.size(), 4U);
  for (const std::string& file : files_of_bag(folder_.string())) {
    BagReader one(file);
    const auto first = one.next();
    ASSERT_TRUE(first) << file;
    EXPECT_EQ(one.contents().topics[first->topic].name, "/robot_description") << file;
  }
  EXPECT_THAT(read(), ElementsAre("0arm", "1a", "2a", "3a", "4a", "5a", "6a"));
}

TEST_F(BagTest, SizeSplitsFilesAndNoMessageIsLost) {
  BagWriterOptions split = options();
  split.max_file_size = 4000;
  split.file.compression = "";
  BagWriter writer(split);
  const std::size_t a = writer.add_topic(topic("/a"));
  for (std::uint32_t i = 0; i < 100; ++i)
    writer.write(a, i + 1, i * kSecond, i * kSecond, text(std::string(100, 'x')));
  writer.close();
  EXPECT_GT(writer.metadata().files.size(), 3U);
  EXPECT_EQ(read().size(), 100U);
}

TEST_F(BagTest, OldestFileIsRemovedWithItsEntryAndNumbersGoOn) {
  BagWriterOptions split = options();
  split.max_file_time = std::chrono::nanoseconds(1);
  BagWriter writer(split);
  writer.remove_oldest();  // the file that is open stays
  const std::size_t a = writer.add_topic(topic("/a"));
  for (std::uint32_t t = 0; t < 6; ++t) {
    writer.write(a, t + 1, t * kSecond, t * kSecond, text("a"));
    if (writer.metadata().files.size() > 3) writer.remove_oldest();
  }
  writer.close();
  std::vector<std::string> paths;
  for (const BagFileCount& file : writer.metadata().files) paths.push_back(file.path);
  const std::string stem = folder_.filename().string();
  EXPECT_THAT(paths, ElementsAre(stem + "_3.mcap", stem + "_4.mcap", stem + "_5.mcap"));
  EXPECT_THAT(read(), ElementsAre("3a", "4a", "5a"));
}

// A reset of the simulation: the times of one file would otherwise mix two runs.
TEST_F(BagTest, TimeThatIsSetBackBeginsNewFileAndReaderKeepsOrderOfWriting) {
  BagWriter writer(options());
  const std::size_t a = writer.add_topic(topic("/a"));
  std::uint32_t number = 0;
  for (const std::uint64_t t : {1, 2, 3, 0, 1})
    writer.write(a, ++number, t * kSecond, t * kSecond, text("a"));
  writer.close();
  EXPECT_EQ(writer.metadata().files.size(), 2U);
  EXPECT_THAT(read(), ElementsAre("1a", "2a", "3a", "0a", "1a"));
}

TEST_F(BagTest, SeekGivesTimesAndTopicsThatAreSelected) {
  BagWriter writer(options());
  const std::size_t a = writer.add_topic(topic("/a")), b = writer.add_topic(topic("/b"));
  for (std::uint32_t t = 0; t < 5; ++t) {
    writer.write(a, t + 1, t * kSecond, t * kSecond, text("a"));
    writer.write(b, t + 1, t * kSecond, t * kSecond, text("b"));
  }
  writer.close();
  EXPECT_THAT(read(1 * kSecond, 3 * kSecond, {.topics = {"/b"}}), ElementsAre("1b", "2b"));
  EXPECT_THAT(read(0, UINT64_MAX, {.topics = {"/c"}}), IsEmpty());
}

TEST_F(BagTest, SameMessagesGiveSameBytes) {
  std::vector<std::string> files;
  for (int i = 0; i < 2; ++i) {
    fs::remove_all(folder_);
    BagWriter writer(options());
    const std::size_t a = writer.add_topic(topic("/a"));
    for (std::uint32_t t = 0; t < 500; ++t) writer.write(a, t + 1, t, t, text("a"));
    writer.close();
    files.push_back(file_text(folder_.filename().string() + "_0.mcap"));
  }
  EXPECT_FALSE(files[0].empty());
  EXPECT_EQ(files[0], files[1]);
}

TEST_F(BagTest, ExistingFolderIsRefusedAndKept) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "mine") << "x";
  EXPECT_THAT([&] { const BagWriter writer(options()); },
              testing::ThrowsMessage<InputError>(HasSubstr("exists already")));
  EXPECT_EQ(file_text("mine"), "x");
}

TEST_F(BagTest, FolderThatWasMadeForBagIsUsed) {
  fs::create_directories(folder_);
  BagWriterOptions chosen = options();
  chosen.is_folder_made = true;
  BagWriter writer(chosen);
  writer.write(writer.add_topic(topic("/a")), 1, kSecond, kSecond, text("x"));
  writer.close();
  EXPECT_THAT(read(), ElementsAre("1x"));
}

TEST_F(BagTest, AttachmentsAndMetadataComeBack) {
  BagWriter writer(options());
  writer.attach({"scenario.yaml", "application/yaml", text("s")}, 5);
  writer.add_metadata("doppel_run", {{"root", "/home/u"}});
  writer.close();
  BagReader reader(folder_.string());
  ASSERT_EQ(reader.contents().attachments.size(), 1U);
  EXPECT_EQ(reader.attachment(reader.contents().attachments[0]), text("s"));
  std::vector<std::string> names;
  for (const BagPart& part : reader.contents().metadata) names.push_back(part.part.name);
  EXPECT_THAT(names, ElementsAre("rosbag2", "doppel_run", "rosbag2"));
  EXPECT_THAT(reader.metadata(reader.contents().metadata[1]), ElementsAre(testing::Pair("root", "/home/u")));
  EXPECT_THAT(reader.metadata(reader.contents().metadata[2]),
              ElementsAre(testing::Pair("serialized_metadata", HasSubstr("version: 9"))));
}

TEST_F(BagTest, MetadataOfOtherStorageIsRefusedByName) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "metadata.yaml") << "rosbag2_bagfile_information:\n  version: 5\n  "
                                              "storage_identifier: sqlite3\n  relative_file_paths: [a.db3]\n";
  EXPECT_THAT([&] { const BagReader reader(folder_.string()); },
              testing::ThrowsMessage<InputError>(HasSubstr("sqlite3")));
}

TEST_F(BagTest, FolderWithoutMetadataIsReadByNumbersOfItsFiles) {
  BagWriterOptions split = options();
  split.max_file_time = std::chrono::nanoseconds(1);
  BagWriter writer(split);
  const std::size_t a = writer.add_topic(topic("/a"));
  for (std::uint32_t t = 0; t < 12; ++t) writer.write(a, t + 1, t * kSecond, t * kSecond, text("a"));
  writer.close();
  fs::remove(folder_ / "metadata.yaml");
  const std::vector<std::string> messages = read();
  ASSERT_EQ(messages.size(), 12U);
  EXPECT_EQ(messages.back(), "11a");
}

}  // namespace
}  // namespace doppel
