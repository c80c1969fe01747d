// LeRobot's file of a calibration as the setup of servos.
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "doppel/devices/drivers/test/driver_bench.h"

namespace doppel::test {
namespace {

constexpr double kTick = 2 * std::numbers::pi / 4096;

std::string motor(const std::string& name, int id, int drive_mode, int homing, int low, int high) {
  return "\"" + name + "\": {\"id\": " + std::to_string(id) +
         ", \"drive_mode\": " + std::to_string(drive_mode) +
         ", \"homing_offset\": " + std::to_string(homing) + ", \"range_min\": " + std::to_string(low) +
         ", \"range_max\": " + std::to_string(high) + "}";
}

class LerobotCalibration : public testing::Test {
 protected:
  LerobotCalibration() {
    folder_ = std::filesystem::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
  }
  ~LerobotCalibration() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

  ServoSetup read(const std::string& calibration = "arm.json") {
    const std::string text =
        three_joints("doppel/FeetechSts", "<param name=\"calibration\">" + calibration + "</param>",
                     "<param name=\"offset_deg\">0</param>");
    write("three.urdf", text);
    PackageResolver packages;
    const RobotDescription robot =
        parse_urdf(text, (folder_ / "three.urdf").string(), packages, diagnostics_);
    const Model model = compile_model(robot, BaseKind::fixed, diagnostics_);
    return read_servo_setup(robot.hardware.front(), model, diagnostics_);
  }
  std::string refusal() {
    try {
      static_cast<void>(read());
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  std::filesystem::path folder_;
  Diagnostics diagnostics_;
};

TEST_F(LerobotCalibration, FileGivesIdsDirectionsZerosAndLimits) {
  write("arm.json", "{" + motor("j1", 4, 0, 100, 748, 3348) + "," + motor("j2", 5, 1, -20, 848, 3448) + "," +
                        motor("j3", 6, 0, 0, 1500, 2600) + "}");
  const ServoSetup setup = read();
  ASSERT_EQ(setup.joints.size(), 3U);
  EXPECT_EQ(setup.joints[0].id, 4);
  EXPECT_EQ(setup.joints[0].direction, 1);
  EXPECT_EQ(setup.joints[1].direction, -1);
  EXPECT_NEAR(setup.joints[0].offset, 0, 1e-12);  // the middle of 748 and 3348 is 2048
  EXPECT_NEAR(setup.joints[1].offset, 100 * kTick, 1e-12);
  EXPECT_NEAR(setup.joints[0].upper, 1300 * kTick, 1e-9);
  EXPECT_NEAR(setup.joints[2].lower, -550 * kTick, 1e-9);
  ASSERT_TRUE(setup.joints[0].recorded);
  EXPECT_EQ(setup.joints[0].recorded->homing_offset, 100);
  EXPECT_TRUE(setup.joints[0].calibrated);
}

TEST_F(LerobotCalibration, IncompleteSweepIsWarning) {
  write("arm.json", "{" + motor("j1", 1, 0, 0, 748, 3348) + "," + motor("j2", 2, 0, 0, 2040, 2060) + "," +
                        motor("j3", 3, 0, 0, 748, 3348) + "}");
  static_cast<void>(read());
  const auto narrow = std::ranges::find(diagnostics_.all(), "calibration.narrow", &Diagnostic::rule);
  ASSERT_NE(narrow, diagnostics_.all().end());
  EXPECT_NE(narrow->message.find("2 of the 229 degrees of 'j2'"), std::string::npos) << narrow->message;
}

TEST_F(LerobotCalibration, HardwareFileWins) {
  write("arm.json", "{" + motor("j1", 1, 0, 0, 748, 3348) + "," + motor("j2", 2, 0, 0, 748, 3348) + "," +
                        motor("j3", 3, 0, 0, 748, 3348) + "}");
  write("hardware.yaml", "Arm: {joints: {j1: {id: 9, direction: -1, offset: 10 deg}}}\n");
  const ServoSetup setup = read();
  EXPECT_EQ(setup.joints[0].id, 9);
  EXPECT_EQ(setup.joints[0].direction, -1);
  EXPECT_NEAR(setup.joints[0].offset, 10 * std::numbers::pi / 180, 1e-9);
}

TEST_F(LerobotCalibration, ErrorsHaveTheirLines) {
  write("arm.json",
        "{\n" + motor("j1", 1, 0, 0, 748, 3348) + ",\n" + motor("jj2", 2, 0, 0, 748, 3348) + ",\n" +
            "\"j3\": {\"id\": 3, \"drive_mode\": 2, \"homming_offset\": 0, \"homing_offset\": 0,\n"
            "\"range_min\": 748, \"range_max\": 5000}}\n");
  const std::string why = refusal();
  for (const char* part : {"arm.json:3:1", "no joint 'jj2'; did you mean 'j2'?", "arm.json:4:31",
                           "did you mean 'homing_offset'?", "drive_mode of the motor 'j3'"})
    EXPECT_NE(why.find(part), std::string::npos) << part << "\n" << why;
}

TEST_F(LerobotCalibration, MissingFileIsNamed) {
  EXPECT_NE(refusal().find("arm.json"), std::string::npos);
}

}  // namespace
}  // namespace doppel::test
