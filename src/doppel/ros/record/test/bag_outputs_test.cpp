// Files of output bags as ros2 bag convert reads them, and what comes of them.
#include "doppel/ros/record/bag_outputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/record/pending_latched.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using std_msgs::msg::String;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class BagOutputsTest : public testing::Test {
 protected:
  BagOutputsTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~BagOutputsTest() override { fs::remove_all(folder_); }

  // Messages "NAME1" to "NAMEcount" of /NAME, a second apart.
  void make_bag(const std::string& name, std::uint64_t first, std::uint64_t count, bool latched = false) {
    BagWriter writer({.folder = folder_ / (name + "_bag")});
    RecordedTopic topic;
    topic.name = "/" + name;
    topic.type = String::kType;
    topic.schema = find_type(topic.type)->schema();
    topic.qos = offered_qos_text({{.depth = 1, .latched = latched}});
    topic.latched = latched ? 1 : 0;
    const std::size_t number = writer.add_topic(topic);
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t time = (first + i) * 1'000'000'000;
      writer.write(number, 0, time, time, to_cdr(String{name + std::to_string(i + 1)}));
    }
    writer.close();
    inputs_.emplace_back((folder_ / (name + "_bag")).string());
  }
  std::vector<OutputBag> outputs(const std::string& text) {
    std::ofstream(folder_ / "out.yaml") << text;
    std::vector<OutputBag> out = read_output_bags(folder_ / "out.yaml", notes_);
    for (OutputBag& one : out) one.bag.folder = folder_ / one.bag.folder;
    return out;
  }
  std::string error(const std::string& text) {
    try {
      check_output_bags(inputs_, outputs(text));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::vector<std::string> read(const std::string& name) const {
    BagReader reader((folder_ / name).string());
    std::vector<std::string> out;
    reader.seek(0, UINT64_MAX, {});
    while (const auto message = reader.next()) {
      String value;
      EXPECT_TRUE(from_cdr(message->data, value));
      out.push_back(std::to_string(message->log_time / 1'000'000'000) + value.data);
    }
    return out;
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("outputs_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  std::vector<BagReader> inputs_;
  Diagnostics notes_;
};

TEST_F(BagOutputsTest, InputsAreMergedByTimeAndSplitByTopics) {
  make_bag("a", 1, 3);
  make_bag("b", 2, 2);
  const auto about = outputs(
      "output_bags:\n- {uri: both, all_topics: true}\n- {uri: only_b, topics: [/b], compression_mode: "
      "file}\n");
  check_output_bags(inputs_, about);
  const std::vector<WrittenBag> written = convert_bags(inputs_, about);
  ASSERT_EQ(written.size(), 2U);
  EXPECT_EQ(written[0].messages, 5U);
  EXPECT_THAT(read("both"), ElementsAre("1a1", "2a2", "2b1", "3a3", "3b2"));
  EXPECT_THAT(read("only_b"), ElementsAre("2b1", "3b2"));
  EXPECT_THAT(BagReader((folder_ / "both").string()).contents().compressions, ElementsAre(""));
  EXPECT_THAT(BagReader((folder_ / "only_b").string()).contents().compressions, ElementsAre("zstd"));
  EXPECT_EQ(notes_.count(Severity::note), 1U) << "expected a note about compressed chunks";
}

TEST_F(BagOutputsTest, PartBeginsWithLatchedMessagesAndIncludesItsEnd) {
  make_bag("robot", 1, 2, true);
  make_bag("a", 1, 9);
  const auto about = outputs(
      "output_bags:\n- uri: part\n  all: true\n  start_time_ns: 5000000000\n  end_time_ns: 6000000000\n"
      "  custom_data: {why: a test}\n");
  static_cast<void>(convert_bags(inputs_, about));
  EXPECT_THAT(read("part"), ElementsAre("5robot2", "5a5", "6a6"));
  std::ifstream metadata(folder_ / "part" / "metadata.yaml");
  const std::string text{std::istreambuf_iterator<char>(metadata), {}};
  EXPECT_THAT(text, HasSubstr("\"why\": \"a test\""));
}

TEST_F(BagOutputsTest, FilesAreSplitByTimeAndSize) {
  make_bag("a", 1, 6);
  static_cast<void>(convert_bags(
      inputs_, outputs("output_bags:\n- {uri: timed, all_topics: true, max_bagfile_duration: 2}\n"
                       "- {uri: sized, all_topics: true, max_bagfile_size: 400}\n")));
  EXPECT_EQ(BagReader((folder_ / "timed").string()).contents().files.size(), 3U);
  EXPECT_GT(BagReader((folder_ / "sized").string()).contents().files.size(), 1U);
}

TEST_F(BagOutputsTest, EveryErrorHasItsPlaceAndNothingIsWritten) {
  make_bag("a", 1, 2);
  EXPECT_THAT(
      error("output_bags:\n- uri: x\n  topcs: [/a]\n"),
      AllOf(HasSubstr("out.yaml:3:3"), HasSubstr("did you mean 'topics'"), HasSubstr("selects no topics")));
  EXPECT_THAT(error("output_bags:\n- uri: x\n  topics: [/b]\n"),
              AllOf(HasSubstr("out.yaml:3:12"), HasSubstr("there is no topic /b")));
  EXPECT_THAT(error("output_bags:\n- uri: x\n  all: true\n- uri: ./x\n  all: true\n"),
              HasSubstr("given twice"));
  EXPECT_THAT(error("output_bags:\n- uri: a_bag\n  all: true\n"), HasSubstr("exists already"));
  EXPECT_THAT(error("output_bags:\n- {uri: x, all: true, storage_id: sqlite3}\n"), HasSubstr("MCAP"));
  EXPECT_THAT(error("output_bags:\n- {uri: x, all: true, max_bagfile_size: 1.5}\n"),
              HasSubstr("whole number from 0 on, not '1.5'"));
  EXPECT_THAT(error("output_bags:\n- {uri: x, regex: '('}\n"), HasSubstr("regular expression"));
  EXPECT_THAT(error("output_bags:\n- {uri: x, all: true, start_time_ns: 9000000000}\n"),
              HasSubstr("behind the end"));
  EXPECT_THAT(error("output_bags:\n- {uri: x, regex: nothing}\n"), HasSubstr("no topic of the recordings"));
  EXPECT_THAT(error("output_bags:\n- {all: true}\n"), HasSubstr("needs a uri"));
  EXPECT_THAT(error("outputs: []\n"), HasSubstr("there are: output_bags"));
  EXPECT_FALSE(fs::exists(folder_ / "x"));
}

TEST_F(BagOutputsTest, WorkThatIsEndedLeavesNoOutput) {
  make_bag("a", 1, 5000);
  const auto about = outputs("output_bags:\n- {uri: x, all: true}\n- {uri: y, all: true}\n");
  EXPECT_THAT(convert_bags(inputs_, about, [](double) { return false; }), IsEmpty());
  EXPECT_FALSE(fs::exists(folder_ / "x"));
  EXPECT_FALSE(fs::exists(folder_ / "y"));
}

TEST_F(BagOutputsTest, KeysOfRosbag2AreKnownAndServicesHaveBothNames) {
  const auto about = outputs(
      "output_bags:\n- uri: x\n  storage_id: \"\"\n  max_bagfile_size: 0\n  storage_preset_profile: \"\"\n"
      "  storage_config_uri: \"\"\n  all_topics: false\n  topics: []\n  topic_types: []\n  all_services: "
      "false\n"
      "  services: [/save/_service_event, /load]\n  rmw_serialization_format: \"\"\n  regex: \"\"\n"
      "  exclude_regex: \"\"\n  exclude_topics: []\n  exclude_topic_types: []\n  exclude_services: []\n"
      "  compression_mode: \"\"\n  compression_format: \"\"\n  compression_queue_size: 1\n"
      "  compression_threads: 0\n  include_hidden_topics: false\n  include_unpublished_topics: false\n");
  ASSERT_EQ(about.size(), 1U);
  EXPECT_THAT(about[0].topics.services, ElementsAre("/save", "/load"));
  EXPECT_TRUE(about[0].topics.selects("/load/_service_event", "t"));
  EXPECT_FALSE(about[0].topics.selects("/load", "t"));
  EXPECT_TRUE(notes_.all().empty());
}

}  // namespace
}  // namespace doppel
