#include "doppel/devices/drivers/motion_guard.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace doppel {
namespace {

constexpr Duration kPeriod{10'000'000};
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// A joint that follows its goals exactly, or is blocked.
struct Joint {
  explicit Joint(const GuardLimits& limits) : guard(limits) { guard.begin(0, now); }
  double cycle(double command) {
    const double goal = guard.goal(command, kPeriod);
    now += kPeriod;
    const double before = q;
    if (!blocked) q = goal;
    const double v = (q - before) / to_seconds(kPeriod);
    guard.take(q, v, blocked && std::abs(goal - q) > 0.05 ? 1.0 : 0.1, now);
    return goal;
  }
  JointGuard guard;
  Time now{};
  double q = 0;
  bool blocked = false;
};

TEST(JointGuard, FarCommandIsReachedAtItsSpeed) {
  Joint joint({.velocity = 2});
  double before = 0;
  int cycles = 0;
  while (std::abs(joint.q - 1) > 1e-9 && cycles < 1000) {
    const double goal = joint.cycle(1);
    EXPECT_LE(std::abs(goal - before), 1.2 * 2 * 0.01 + 1e-12);
    before = goal;
    ++cycles;
  }
  EXPECT_NEAR(cycles * 0.01, 1 / (1.2 * 2), 0.02);
  EXPECT_TRUE((joint.guard.take_events() & kClampedStep) != 0);
}

TEST(JointGuard, ClampIsReportedOnceUntilItEnds) {
  Joint joint({.velocity = 1});
  joint.cycle(1);
  EXPECT_EQ(joint.guard.take_events(), kClampedStep);
  joint.cycle(1);
  EXPECT_EQ(joint.guard.take_events(), 0U);
  for (int i = 0; i < 200; ++i) joint.cycle(1);
  joint.guard.take_events();
  joint.cycle(-1);
  EXPECT_EQ(joint.guard.take_events(), kClampedStep);
}

TEST(JointGuard, CommandBeyondLimitStopsAtIt) {
  Joint joint({.lower = -0.2, .upper = 0.2, .velocity = 10});
  for (int i = 0; i < 100; ++i) joint.cycle(5);
  EXPECT_DOUBLE_EQ(joint.q, 0.2);
  EXPECT_TRUE((joint.guard.take_events() & kClampedLimit) != 0);
}

TEST(JointGuard, NoCommandKeepsGoal) {
  Joint joint({.velocity = 1});
  for (int i = 0; i < 50; ++i) joint.cycle(0.1);
  for (int i = 0; i < 50; ++i) EXPECT_DOUBLE_EQ(joint.cycle(kNaN), 0.1);
}

TEST(JointGuard, GentleMotionHasQuarterOfSpeed) {
  Joint joint({.velocity = 2});
  joint.guard.set_gentle(true);
  for (int i = 0; i < 100; ++i) joint.cycle(10);
  EXPECT_NEAR(joint.q, 0.5, 1e-9);
  EXPECT_EQ(joint.guard.take_events(), 0U);
}

TEST(JointGuard, HotServoHasHalfOfSpeed) {
  Joint joint({.velocity = 2});
  joint.guard.take_temperature(61);
  EXPECT_EQ(joint.guard.take_events(), kHalvedSpeed);
  for (int i = 0; i < 100; ++i) joint.cycle(10);
  EXPECT_NEAR(joint.q, 1.0, 1e-9);
  joint.guard.take_temperature(57);
  joint.cycle(10);
  EXPECT_NEAR(joint.q, 1.01, 1e-9) << "it stays slow until it has cooled";
}

TEST(JointGuard, GoalIsAtMost50MillisecondsAhead) {
  Joint joint({.velocity = 4});
  joint.blocked = true;
  joint.guard = JointGuard({.velocity = 4, .stalls_by_intent = true});
  joint.guard.begin(0, joint.now);
  double most = 0;
  for (int i = 0; i < 200; ++i) most = std::max(most, joint.cycle(3));
  EXPECT_NEAR(most, 0.05 * 4, 1e-12);
}

TEST(JointGuard, SampleThatJumpsIsDroppedUnlessNextAgrees) {
  JointGuard guard({.velocity = 1});
  Time now{};
  guard.begin(0, now);
  now += kPeriod;
  guard.take(2.0, 0, 0, now);
  EXPECT_DOUBLE_EQ(guard.position(), 0);
  EXPECT_EQ(guard.take_events(), kDroppedSample);
  now += kPeriod;
  guard.take(0.01, 0, 0, now);
  EXPECT_DOUBLE_EQ(guard.position(), 0.01);
  now += kPeriod;
  guard.take(1.5, 0, 0, now);
  now += kPeriod;
  guard.take(1.501, 0, 0, now);
  EXPECT_DOUBLE_EQ(guard.position(), 1.501) << "two samples that agree are the joint's";
}

TEST(JointGuard, BlockedJointYieldsAndGoesOnWhenItIsFree) {
  Joint joint({.velocity = 2});
  joint.blocked = true;
  for (int i = 0; i < 70; ++i) joint.cycle(1);
  EXPECT_TRUE(joint.guard.is_stalled());
  EXPECT_TRUE((joint.guard.take_events() & kStalled) != 0);
  EXPECT_NEAR(joint.cycle(1), 0.02, 1e-12);
  joint.blocked = false;
  for (int i = 0; i < 200; ++i) joint.cycle(1);
  EXPECT_FALSE(joint.guard.is_stalled());
  EXPECT_TRUE((joint.guard.take_events() & kReleased) != 0);
  EXPECT_NEAR(joint.q, 1, 1e-9);
}

TEST(JointGuard, GripperMayStall) {
  Joint joint({.velocity = 2, .stalls_by_intent = true});
  joint.blocked = true;
  for (int i = 0; i < 300; ++i) joint.cycle(1);
  EXPECT_FALSE(joint.guard.is_stalled());
}

TEST(JointGuard, HoldKeepsPresentPosition) {
  Joint joint({.velocity = 2});
  for (int i = 0; i < 10; ++i) joint.cycle(1);
  joint.guard.hold();
  const double q = joint.guard.position();
  for (int i = 0; i < 10; ++i) EXPECT_DOUBLE_EQ(joint.cycle(kNaN), q);
}

// Whatever is commanded, no goal leaves the limits, jumps, or runs ahead of the joint.
TEST(JointGuard, RandomCommandsNeverGiveWildGoals) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> wild(-1e3, 1e3), unit(0, 1);
    const GuardLimits limits{-1 - unit(random), 1 + unit(random), 0.2 + 8 * unit(random), unit(random) < 0.3};
    Joint joint(limits);
    joint.guard.set_gentle(unit(random) < 0.3);
    double before = 0;
    for (int i = 0; i < 500; ++i) {
      const double kind = unit(random);
      const double command = kind < 0.2   ? kNaN
                             : kind < 0.3 ? std::copysign(INFINITY, wild(random))
                                          : wild(random) / 500;
      joint.blocked = unit(random) < 0.01 ? !joint.blocked : joint.blocked;
      if (unit(random) < 0.05) joint.guard.take(wild(random), wild(random), wild(random), joint.now);
      if (unit(random) < 0.02) joint.guard.take_temperature(20 + 60 * unit(random));
      const double position = joint.guard.position();
      const double goal = joint.cycle(command);
      ASSERT_TRUE(std::isfinite(goal));
      ASSERT_GE(goal, limits.lower - 1e-12);
      ASSERT_LE(goal, limits.upper + 1e-12);
      const double ahead = std::max(0.05 * limits.velocity, 0.05);
      ASSERT_LE(std::abs(goal - position), ahead + 1e-12);
      before = goal;
    }
    ASSERT_TRUE(std::isfinite(before));
  }
}

}  // namespace
}  // namespace doppel
