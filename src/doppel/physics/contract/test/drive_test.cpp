#include "doppel/physics/contract/detail/drive.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace doppel {
namespace {

constexpr Duration kStep{1'000'000};

ServoParameters servo() {
  return {100.0, 4.0, 50.0, 2.0, false};
}  // stiffness, damping, effort, velocity

// At the end of the step that begins now, before clipping.
double effort_at(Drive& drive, double q, double v) {
  drive.advance(q, 0.0);
  JointSpring spring;
  drive.write_law(spring);
  return spring.on ? spring.law(q, v, 1e-3) : 0.0;
}

// The same, as it acts.
double clipped_effort_at(Drive& drive, double q, double v) {
  const double asked = effort_at(drive, q, v);
  JointSpring spring;
  drive.write_law(spring);
  return std::clamp(asked, spring.low, spring.high);
}

TEST(Drive, PassiveUntilStarted) {
  Drive drive(0, servo(), 1.0, kStep);
  drive.set_target(1.0);
  EXPECT_EQ(effort_at(drive, 0.3, 1.0), 0.0);
}

TEST(Drive, StartBeginsAtJointPosition) {
  Drive drive(0, servo(), 1.0, kStep);
  drive.start(DriveMode::position, 0.3);
  EXPECT_NEAR(effort_at(drive, 0.3, 0.0), 0.0, 1e-12);
  EXPECT_NEAR(effort_at(drive, 0.29, 0.0), 1.0, 1e-12) << "expected the effort of a spring";
  EXPECT_NEAR(effort_at(drive, 0.3, 0.5), -2.0, 1e-12) << "expected the effort of a damper";
}

TEST(Drive, StepRunsAtVelocityLimit) {
  Drive drive(0, servo(), 1.0, kStep);
  drive.start(DriveMode::position, 0.0);
  drive.set_target(1.0);
  double q = 0.0;
  for (int i = 1; i <= 400; ++i) {
    q = 0.002 * i;  // a joint that follows exactly
    EXPECT_NEAR(effort_at(drive, q, 0.0), 4.0 * 0.5 * 2.0, 1e-9);
  }
}

TEST(Drive, StreamedTargetsAreSpreadOverPeriod) {
  Drive drive(0, servo(), 1.0, kStep);
  drive.start(DriveMode::position, 0.0);
  double q = 0.0;
  for (int target = 1; target <= 20; ++target) {
    drive.set_target(0.01 * target);  // 100 Hz, 1 rad/s
    for (int i = 0; i < 10; ++i) {
      const double effort = effort_at(drive, q, 1.0);
      if (target > 3) {
        EXPECT_NEAR(effort, 100.0 * (0.01 * (target - 1) + 0.001 * (i + 1) - q), 1e-9)
            << "expected a reference velocity of 1 rad/s";
      }
      q = 0.01 * (target - 1) + 0.001 * i;
    }
  }
  for (int i = 0; i < 10; ++i) effort_at(drive, 0.2, 0.0);
  EXPECT_NEAR(effort_at(drive, 0.2, 0.0), 0.0, 1e-9) << "expected the last target to be reached";
}

TEST(Drive, BlockedJointHoldsReference) {
  Drive drive(0, servo(), 1.0, kStep);
  drive.start(DriveMode::position, 0.0);
  drive.set_target(10.0);
  for (int i = 0; i < 5000; ++i) drive.advance(0.0, 0.0);
  // Released beside its target, the joint does not jump: the reference is half a radian ahead, not ten.
  EXPECT_LE(effort_at(drive, 0.0, 0.0), 50.0 + 4.0 * 2.0 + 100.0 * 0.002 + 1e-9);
  drive.start(DriveMode::velocity, 0.0);
  drive.set_target(1.0);
  for (int i = 0; i < 5000; ++i) drive.advance(0.0, 0.0);
  EXPECT_LE(effort_at(drive, 0.0, 0.0), 50.0 + 4.0 * 2.0 + 100.0 * 0.002 + 1e-9);
}

TEST(Drive, VelocityAndEffortTargetsAreClipped) {
  Drive drive(0, servo(), 1.0, kStep);
  drive.start(DriveMode::velocity, 0.0);
  drive.set_target(-7.0);
  drive.advance(0.0, 0.0);
  const double first = drive.reference();
  drive.advance(0.0, 0.0);
  EXPECT_NEAR(drive.reference() - first, -2.0 * 1e-3, 1e-12);
  drive.start(DriveMode::effort, 0.0);
  drive.set_target(80.0);
  EXPECT_EQ(clipped_effort_at(drive, 0.7, 1.9), 50.0);
  EXPECT_NEAR(clipped_effort_at(drive, 0.7, 1.99), 25.0, 1e-9) << "expected half of it in the last percent";
  EXPECT_EQ(clipped_effort_at(drive, 0.7, 3.0), 0.0) << "expected none beyond the velocity limit";
  EXPECT_EQ(clipped_effort_at(drive, 0.7, -3.0), 50.0) << "expected the whole against the motion";
}

TEST(Drive, NanTargetIsIgnored) {
  Drive drive(0, servo(), 1.0, kStep);
  drive.start(DriveMode::effort, 0.0);
  drive.set_target(3.0);
  drive.set_target(std::numeric_limits<double>::quiet_NaN());
  drive.set_target(std::numeric_limits<double>::infinity());
  EXPECT_EQ(clipped_effort_at(drive, 0.0, 0.0), 3.0);
}

TEST(Drive, StepWithoutVelocityLimitJumps) {
  ServoParameters unlimited = servo();
  unlimited.velocity = kInfinity;
  Drive drive(0, unlimited, 1.0, kStep);
  drive.start(DriveMode::position, 0.0);
  drive.set_target(0.1);
  EXPECT_NEAR(effort_at(drive, 0.0, 0.0), 10.0, 1e-9);
}

}  // namespace
}  // namespace doppel
