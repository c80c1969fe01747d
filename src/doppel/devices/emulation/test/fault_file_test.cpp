#include "doppel/devices/emulation/fault_file.h"

#include <gmock/gmock.h>

#include <fstream>

namespace doppel {
namespace {

using testing::HasSubstr;

class FaultFileTest : public testing::Test {
 protected:
  FaultFileTest()
      : path_(std::filesystem::path(testing::TempDir()) /
              (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".yaml")) {}
  void save(const std::string& text) const {
    std::ofstream(path_) << text;
    // Two saves within the clock's resolution of the file system would be one.
    std::filesystem::last_write_time(path_, std::filesystem::file_time_type::clock::now() + ++saves_);
  }
  const std::filesystem::path path_;
  mutable std::chrono::seconds saves_{0};
};

TEST_F(FaultFileTest, TimesCountFromReading) {
  save("faults: [{fault: unplug, begin: 2 s, end: 3 s}, {fault: drop, share: 1 %, servo: 4}]");
  const std::vector<EmulatedFault> faults = read_fault_file(path_, Time(from_seconds(10)));
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_EQ(faults[0].kind, FaultKind::unplug);
  EXPECT_EQ(faults[0].begin, Time(from_seconds(12)));
  EXPECT_EQ(faults[0].end, Time(from_seconds(13)));
  EXPECT_EQ(faults[1].servo, 4);
  EXPECT_DOUBLE_EQ(faults[1].share, 0.01);
  EXPECT_EQ(faults[1].end, Time::max());
}

TEST_F(FaultFileTest, SlipHasUnitOfAngle) {
  save("faults: [{fault: slip, amount: 90 deg}, {fault: hot, amount: 72}]");
  const std::vector<EmulatedFault> faults = read_fault_file(path_, Time{});
  EXPECT_NEAR(faults[0].amount, 1.5708, 1e-4);
  EXPECT_DOUBLE_EQ(faults[1].amount, 72);
}

TEST_F(FaultFileTest, ErrorsHaveTheirPlacesAndNearestNames) {
  save("faults:\n  - {fault: unplg}\n  - {fault: drop, shre: 2}\n  - {fault: drop, begin: 3 s, end: 1 s}\n");
  try {
    static_cast<void>(read_fault_file(path_, Time{}));
    FAIL();
  } catch (const InputError& problem) {
    const std::string text = problem.what();
    EXPECT_THAT(text, HasSubstr("did you mean 'unplug'"));
    EXPECT_THAT(text, HasSubstr("did you mean 'share'"));
    EXPECT_THAT(text, HasSubstr(":4:"));
    EXPECT_THAT(text, HasSubstr("must end after it begins"));
  }
}

// They become whole numbers and times.
TEST_F(FaultFileTest, NumbersBeyondTheirRangeAreRefused) {
  for (const char* fault :
       {"{fault: drop, servo: 1e300}", "{fault: drop, servo: -1}", "{fault: drop, share: nan}",
        "{fault: drop, share: 101 %}", "{fault: late, amount: 1e300}", "{fault: late, amount: -1 s}",
        "{fault: hot, amount: 1e300}", "{fault: drop, begin: 1e300}", "{fault: slip, amount: inf}"}) {
    save(std::string("faults:\n  - ") + fault + "\n");
    EXPECT_THROW(static_cast<void>(read_fault_file(path_, Time{})), InputError) << fault;
  }
}

TEST_F(FaultFileTest, FileIsReadAgainAfterEachSave) {
  save("faults: []");
  FaultFile file(path_);
  EXPECT_TRUE(file.read_if_changed(Time{}).has_value());
  EXPECT_FALSE(file.read_if_changed(Time{}).has_value());
  save("faults: [{fault: echo}]");
  const auto fresh = file.read_if_changed(Time{});
  ASSERT_TRUE(fresh.has_value());
  EXPECT_EQ(fresh->size(), 1U);
}

// The clock of a file system is coarse: a save that was read in its middle ends with the same time.
TEST_F(FaultFileTest, RestOfSaveWithSameTimeIsRead) {
  save("");
  const auto time = std::filesystem::last_write_time(path_);
  FaultFile file(path_);
  Log log;
  static_cast<void>(read_again(file, Time{}, log, "Arm"));
  save("faults: [{fault: echo}]");
  std::filesystem::last_write_time(path_, time);
  const auto fresh = file.read_if_changed(Time{});
  ASSERT_TRUE(fresh.has_value());
  EXPECT_EQ(fresh->size(), 1U);
}

TEST_F(FaultFileTest, ErrorOfRunningEmulationIsLoggedAndKeepsFaults) {
  save("faults: []");
  FaultFile file(path_);
  static_cast<void>(file.read_if_changed(Time{}));
  save("faults: 3");
  Log log;
  std::string text;
  log.add_sink([&](const LogLine& line) { text += line.text; });
  EXPECT_FALSE(read_again(file, Time{}, log, "Arm").has_value());
  EXPECT_THAT(text, HasSubstr("faults must be a list"));
}

}  // namespace
}  // namespace doppel
