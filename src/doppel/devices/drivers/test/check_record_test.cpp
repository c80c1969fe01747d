// The record of what was checked, which decides the driver's speed.
#include "doppel/devices/drivers/check_record.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "doppel/devices/drivers/test/driver_bench.h"

namespace doppel {
namespace {

using test::DriverBench;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class CheckRecordTest : public testing::Test {
 protected:
  CheckRecordTest()
      : folder_(std::filesystem::temp_directory_path() / ("checks_" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(folder_);
    ::setenv("XDG_STATE_HOME", folder_.c_str(), 1);
  }
  ~CheckRecordTest() override {
    std::filesystem::remove_all(folder_);
    ::unsetenv("XDG_STATE_HOME");
  }
  static std::string until_checked() { return "<param name=\"rate\">1000000</param>"; }
  static CheckRecord complete(const ServoSetup& setup) {
    CheckRecord out;
    out.checked = fingerprint(setup);
    for (const JointServo& one : setup.joints) add_nudged(out, one);
    return out;
  }
  std::filesystem::path folder_;
};

TEST_F(CheckRecordTest, WrittenRecordIsReadAgain) {
  DriverBench bench;
  ASSERT_TRUE(bench.initialise());
  const ServoSetup& setup = bench.driver->setup();
  const auto file = check_record_file("Arm", "/dev/ttyUSB7");
  EXPECT_THAT(unconfirmed_joints(read_check_record(file), setup), ElementsAre("j1", "j2", "j3"));
  write_check_record(file, complete(setup));
  const CheckRecord record = read_check_record(file);
  EXPECT_TRUE(is_checked(record, setup));
  EXPECT_THAT(unconfirmed_joints(record, setup), IsEmpty());
}

TEST_F(CheckRecordTest, ChangedMountingOfJointIsToBeConfirmedAgain) {
  DriverBench bench;
  ASSERT_TRUE(bench.initialise());
  ServoSetup setup = bench.driver->setup();
  const CheckRecord record = complete(setup);
  setup.joints[1].direction = -1;
  EXPECT_THAT(unconfirmed_joints(record, setup), ElementsAre("j2"));
  EXPECT_FALSE(is_checked(record, setup));
}

TEST_F(CheckRecordTest, DriverIsGentleUntilRecordIsComplete) {
  DriverBench bench("doppel/FeetechSts", until_checked());
  bench.start();
  EXPECT_THAT(bench.logged, HasSubstr("gentle: a quarter of the speed"));
  EXPECT_THAT(bench.logged, HasSubstr("doppel hardware nudge --joint \"j1\""));
  bench.commands = {1.9, 1.9, 1.9};
  bench.run(1.0);
  EXPECT_NEAR(bench.q(0), 1.0, 0.05);

  write_check_record(check_record_file("Arm", "emulated"), complete(bench.driver->setup()));
  DriverBench checked("doppel/FeetechSts", until_checked());
  checked.start();
  EXPECT_THAT(checked.logged, testing::Not(HasSubstr("gentle")));
  checked.commands = {1.9, 1.9, 1.9};
  checked.run(1.0);
  EXPECT_NEAR(checked.q(0), 1.9, 0.05);
}

TEST_F(CheckRecordTest, RefusedStartOutsideLimitsNamesRecovery) {
  DriverBench bench;
  bench.machine.states[1].position = 2.5;
  for (int i = 0; i < 10; ++i) bench.machine.step();
  ASSERT_TRUE(bench.initialise());
  ASSERT_TRUE(bench.driver->on_configure());
  EXPECT_THAT(bench.driver->on_activate().why(), HasSubstr("doppel hardware recover --joint \"j2\""));
}

}  // namespace
}  // namespace doppel
