// The drive of a base report in a twin whose physics fails.

#include "doppel/lab/base_report/detail/base_drive.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

namespace doppel {
namespace {

TEST(BaseDriveTest, DivergenceEndsDrive) {
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = "rover_skid"}};
  Diagnostics diagnostics;
  BaseDrive base(scenario, "", diagnostics);
  base.drive(0.1, 0, 0);
  Instance robot = base.twin().robot().instance();
  const std::string wheel = base.twin().robot().joints().front().name;
  robot.apply_joint_effort(robot.model().find_joint(wheel), 1e200);
  const std::uint64_t before = base.twin().steps();
  base.drive(0.1, 0, 0);
  EXPECT_TRUE(base.diverged());
  EXPECT_EQ(base.twin().steps(), before + 1) << "expected that nothing steps a diverged twin";
}

TEST(BaseReportTest, DivergenceIsReportedWithItsLeg) {
  const std::filesystem::path world = std::filesystem::path(testing::TempDir()) / "base_diverges.yaml";
  std::ofstream(world) << "gravity: [0, 0, -1.0e+200]\n";
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = "rover_skid"}};
  scenario.world = world;
  Diagnostics diagnostics;
  const BaseReport report = report_base(scenario, {}, diagnostics);
  ASSERT_TRUE(report.diverged);
  EXPECT_EQ(report.diverged->leg, "5 m straight");
  EXPECT_LT(report.diverged->time, 1.0);
  EXPECT_THAT(base_report_text(report), testing::HasSubstr("in the leg: 5 m straight"));
  EXPECT_THAT(base_report_json(report), testing::HasSubstr("\"diverged\""));
}

}  // namespace
}  // namespace doppel
