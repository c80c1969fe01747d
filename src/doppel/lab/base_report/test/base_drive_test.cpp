// The drive of a base report in a twin whose physics fails.

#include "doppel/lab/base_report/detail/base_drive.h"

#include <gmock/gmock.h>

namespace doppel {
namespace {

TEST(BaseDriveTest, DivergenceEndsDriveWithError) {
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = "rover_skid"}};
  Diagnostics diagnostics;
  BaseDrive base(scenario, "", diagnostics);
  base.drive(0.1, 0, 0);
  Instance robot = base.twin().robot().instance();
  const std::string wheel = base.twin().robot().joints().front().name;
  robot.apply_joint_effort(robot.model().find_joint(wheel), 1e200);
  try {
    base.drive(0.1, 0, 0);
    FAIL() << "expected an InputError: the physics diverges";
  } catch (const InputError& problem) {
    EXPECT_THAT(problem.what(), testing::HasSubstr("the simulation diverges while the base drives"));
  }
}

}  // namespace
}  // namespace doppel
