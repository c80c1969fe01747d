// X9 beside the closed form of a joint that friction alone stops.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "doppel/validation/extras/detail/joint_stop.h"
#include "doppel/validation/extras/stopping_extra.h"
#include "extra_robots.h"

namespace doppel {
namespace {

constexpr double kDiscInertia = 0.05, kFriction = 0.4;  // kg m^2, N m

// A disc about a vertical axis, which gravity does not turn.
std::string disc() {
  return R"(<robot name="disc"><link name="base_link"/>)" + bar_link("plate", 1, 0, kDiscInertia) +
         hinge_text({.name = "turn",
                     .parent = "base_link",
                     .child = "plate",
                     .axis = "0 0 1",
                     .effort = 5,
                     .velocity = 4,
                     .friction = kFriction}) +
         "</robot>";
}

TEST(Stopping, WayWithoutPowerIsThatOfFriction) {
  const WrittenRobot robot(disc());
  const CheckContext context = robot.context();
  MachineRun machine(context, {});
  const int joint = machine.model().find_joint("turn"), link = machine.model().find_link("plate");
  const std::shared_ptr<const SavedState> start = machine.save();
  for (const double speed : {1.3, -2.6, 4.0}) {
    static_cast<void>(machine.twin().robot().controller_manager().reset_stop());
    machine.restore(*start);
    const auto stop = stop_joint(machine, joint, link, speed, StopCategory::off);
    ASSERT_TRUE(stop);
    EXPECT_TRUE(stop->figures.stopped);
    const double way = kDiscInertia * speed * speed / (2 * kFriction);
    EXPECT_NEAR(stop->figures.distance, way, 0.01 * way) << speed;
    EXPECT_NEAR(stop->figures.time, kDiscInertia * std::abs(speed) / kFriction,
                0.01 * kDiscInertia * 4 / kFriction);
  }
}

TEST(Stopping, BrakingDriveIsLimitedByItsEffort) {
  const WrittenRobot robot(disc());
  const CheckContext context = robot.context();
  MachineRun machine(context, {});
  const int joint = machine.model().find_joint("turn"), link = machine.model().find_link("plate");
  const auto stop = stop_joint(machine, joint, link, 4, StopCategory::brake_and_hold);
  ASSERT_TRUE(stop);
  EXPECT_TRUE(stop->figures.stopped);
  EXPECT_GE(stop->figures.largest_way, 0.95 * kDiscInertia * 16 / (2 * (5 + kFriction)));
  EXPECT_LT(stop->figures.largest_way, kDiscInertia * 16 / (2 * kFriction));
}

// A tool that lies on the ground slides there for seconds.
TEST(Stopping, BrakedArmDoesNotLieOnGround) {
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = "omarm_zero"}};
  const Subject subject = read_subject(scenario, {});
  const Suite suite;
  CheckContext context{subject, suite};
  context.effort = Effort::full;
  context.joint = "Revolute 5";
  const CheckResult result = check_stopping(context);
  ASSERT_EQ(result.verdict, Verdict::passed);
  double longest = 0;
  for (const Metric& metric : result.metrics) {
    if (metric.name == "stopping time" && metric.subject.ends_with("category 2"))
      longest = std::max(longest, metric.value);
  }
  EXPECT_GT(longest, 0);
  EXPECT_LT(longest, 0.2);
}

TEST(Stopping, ArmIsStoppedInEveryCategory) {
  const WrittenRobot robot(two_link_arm());
  CheckContext context = robot.context();
  context.joint = "shoulder";
  const CheckResult result = check_stopping(context);
  EXPECT_EQ(result.verdict, Verdict::passed);
  EXPECT_EQ(result.metrics.size(), 9U);
  ASSERT_EQ(result.items.size(), 1U);
  EXPECT_EQ(result.items.front().curves.front().curves.size(), 3U);
  EXPECT_EQ(result.items.front().poses.size(), 3U);
}

}  // namespace
}  // namespace doppel
