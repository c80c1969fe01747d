// The journal of a run: one file whose times ascend, and its end where it is too large.
#include "doppel/lab/recording/run_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "doppel/base/core/output_file.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/twin/journal/input_journal.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using doppel_msgs::msg::Input;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class RunJournalTest : public testing::Test {
 protected:
  RunJournalTest() {
    fs::remove_all(folder_.parent_path());
    fs::create_directories(folder_.parent_path());
  }
  ~RunJournalTest() override { fs::remove_all(folder_.parent_path()); }

  void write(RunJournal& journal, const std::string& topic, double seconds,
             std::vector<std::uint8_t> data = {}) {
    Input input;
    input.data = std::move(data);
    const Bytes cdr = to_cdr(input);
    BagTopicCount about;
    about.name = topic;
    about.type = Input::kType;
    journal.write(about, {0, time_from_nanoseconds(std::llround(1e9 * seconds)), cdr, ++sequence_});
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("journal_") + testing::UnitTest::GetInstance()->current_test_info()->name()) / "journal";
  std::uint32_t sequence_ = 0;
};

TEST_F(RunJournalTest, ResetOfTimeStaysInOneFileInOrder) {
  RunJournal journal(folder_, "jazzy", 1U << 20U);
  for (const double seconds : {1.0, 2.0, 0.5}) write(journal, kInputsTopic, seconds);
  write(journal, "/joint_states", 3);
  journal.flush();
  const auto attachment = journal_attachment(folder_);
  ASSERT_TRUE(attachment);
  const fs::path file = folder_.parent_path() / "run.mcap";
  write_whole(file, {reinterpret_cast<const char*>(attachment->data.data()), attachment->data.size()});
  BagReader bag(file.string());
  EXPECT_THAT(bag.contents().notes, IsEmpty());
  bag.seek(0, UINT64_MAX, {.hidden = true});
  std::vector<std::uint32_t> sequences;
  std::vector<double> stamps;
  while (const auto message = bag.next()) {
    sequences.push_back(message->sequence);
    stamps.push_back(1e-9 * static_cast<double>(message->publish_time));
  }
  EXPECT_THAT(sequences, ElementsAre(1, 2, 3));
  EXPECT_THAT(stamps, ElementsAre(1.0, 2.0, 0.5));
}

TEST_F(RunJournalTest, TooManyInputsEndItAndRemoveItsFiles) {
  RunJournal journal(folder_, "jazzy", 100'000);
  std::mt19937 random(5);
  for (int i = 0; i < 200; ++i) {
    std::vector<std::uint8_t> noise(1000);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
    write(journal, kInputsTopic, i, noise);
  }
  EXPECT_THAT(journal.end(), HasSubstr("MB"));
  EXPECT_FALSE(fs::exists(folder_));
  EXPECT_FALSE(journal_attachment(folder_));
}

}  // namespace
}  // namespace doppel
