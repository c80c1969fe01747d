// Names of recordings, and how many there are.
#include "doppel/validation/motions/detail/failure_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace doppel {
namespace {

using testing::HasSubstr;

TEST(FailureRecorder, NamesAreSafeForFiles) {
  EXPECT_EQ(recording_file("T4", "Revolute 2", {}), "T4_Revolute_2.mcap");
  EXPECT_EQ(recording_file("T2", "../a/b \"<&>\n\xC3\xA4", {}), "T2_.._a_b________.mcap");
  EXPECT_LE(recording_file("T2", std::string(1000, 'x'), {}).size(), 100U);
}

TEST(FailureRecorder, NamesThatBecomeEqualAreNumbered) {
  const std::vector<FailureRecording> others = {{"T4_a_b.mcap", nullptr}, {"T4_a_b_2.mcap", nullptr}};
  EXPECT_EQ(recording_file("T4", "a b", others), "T4_a_b_3.mcap");
}

class FailureRecorderTest : public testing::Test {
 protected:
  CheckItem item(const std::string& part) {
    CheckItem out;
    recorder_.record(out, part, [this] {
      ++motions_;
      return RecordedMotion{{std::byte{1}}, {"a mesh is not in it"}};
    });
    return out;
  }
  const Subject subject_;
  const Suite suite_;
  CheckContext context_{subject_, suite_};
  CheckResult result_ = begin_result("T4");
  FailureRecorder recorder_{context_, result_};
  int motions_ = 0;
};

TEST_F(FailureRecorderTest, NothingIsRecordedUnlessAsked) {
  EXPECT_EQ(item("a").recording, "");
  EXPECT_EQ(motions_, 0);
}

TEST_F(FailureRecorderTest, FirstFailureOfEachJointIsRecordedUpToLimit) {
  context_.record = true;
  EXPECT_EQ(item("joint 0").recording, "T4_joint_0.mcap");
  EXPECT_EQ(item("joint 0").recording, "");
  for (std::size_t i = 1; i < 2 * kMaxRecordings; ++i) item("joint " + std::to_string(i));
  EXPECT_EQ(result_.recordings.size(), kMaxRecordings);
  EXPECT_EQ(motions_, static_cast<int>(kMaxRecordings));
  EXPECT_THAT(result_.notes.front(), HasSubstr("T4_joint_0.mcap: a mesh is not in it"));
  EXPECT_THAT(result_.notes.back(), HasSubstr("no more"));
  EXPECT_EQ(result_.notes.size(), kMaxRecordings + 1);
}

}  // namespace
}  // namespace doppel
