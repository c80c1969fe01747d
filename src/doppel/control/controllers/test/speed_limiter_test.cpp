#include "doppel/control/controllers/detail/speed_limiter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/detail/planar_odometry.h"

namespace doppel {
namespace {

TEST(SpeedLimiter, WithoutLimitsEveryCommandPasses) {
  SpeedLimiter limiter;
  ASSERT_TRUE(limiter.set({}).ok());
  EXPECT_EQ(limiter.limit(100, 0.01), 100);
  EXPECT_EQ(limiter.limit(-100, 0.01), -100);
}

TEST(SpeedLimiter, MinimumIsNegativeMaximumByDefault) {
  SpeedLimiter limiter;
  ASSERT_TRUE(limiter.set({.max_velocity = 2}).ok());
  EXPECT_EQ(limiter.limit(-5, 0.01), -2);
  ASSERT_TRUE(limiter.set({.min_velocity = -1, .max_velocity = 2}).ok());
  EXPECT_EQ(limiter.limit(-5, 0.01), -1);
}

TEST(SpeedLimiter, MinimumAloneHasNoEffect) {
  SpeedLimiter limiter;
  ASSERT_TRUE(limiter.set({.min_velocity = -1}).ok());
  EXPECT_EQ(limiter.limit(-5, 0.01), -5);
}

TEST(SpeedLimiter, CrossedLimitsAreRefusedAndFormerOnesStay) {
  SpeedLimiter limiter;
  ASSERT_TRUE(limiter.set({.max_velocity = 2}).ok());
  EXPECT_FALSE(limiter.set({.min_velocity = 3, .max_velocity = 1}).ok());
  EXPECT_FALSE(limiter.set({.min_jerk = 3, .max_jerk = 1}).ok());
  EXPECT_FALSE(limiter.set({.max_acceleration = 1, .max_acceleration_reverse = 2}).ok());
  EXPECT_EQ(limiter.limit(5, 0.01), 2);
}

// While the acceleration grows by the jerk j, the velocity is j t^2 / 2 (here its sum over steps).
TEST(SpeedLimiter, JerkLimitsGrowthOfAcceleration) {
  SpeedLimiter limiter;
  ASSERT_TRUE(limiter.set({.max_jerk = 5}).ok());
  double velocity = 0;
  for (int i = 1; i <= 100; ++i) velocity = limiter.limit(10, 0.01);
  EXPECT_NEAR(velocity, 5 * 0.01 * 0.01 * 100 * 101 / 2, 1e-9);
}

TEST(SpeedLimiter, DecreaseOfAccelerationIsImmediate) {
  SpeedLimiter limiter;
  ASSERT_TRUE(limiter.set({.max_jerk = 5}).ok());
  for (int i = 0; i < 100; ++i) limiter.limit(1.0, 0.01);
  double highest = 0;
  for (int i = 0; i < 300; ++i) highest = std::max(highest, limiter.limit(1.0, 0.01));
  EXPECT_LE(highest, 1.0 + 1e-12);
  EXPECT_NEAR(limiter.last(), 1.0, 1e-12);
}

TEST(SpeedLimiter, ResetStartsFromRest) {
  SpeedLimiter limiter;
  ASSERT_TRUE(limiter.set({.max_acceleration = 1}).ok());
  for (int i = 0; i < 100; ++i) limiter.limit(1, 0.01);
  limiter.reset();
  EXPECT_DOUBLE_EQ(limiter.limit(1, 0.01), 0.01);
}

TEST(PlanarOdometry, SidewaysArcIsExact) {
  PlanarOdometry odometry;
  odometry.set_window(3);
  for (int i = 0; i < 100; ++i) odometry.move({0, 1, 0.5}, 0.01);  // a circle of radius 2 about (-2, 0)
  EXPECT_NEAR(odometry.pose().x, 2 * (std::cos(0.5) - 1), 1e-12);
  EXPECT_NEAR(odometry.pose().y, 2 * std::sin(0.5), 1e-12);
  EXPECT_NEAR(odometry.pose().yaw, 0.5, 1e-12);
}

TEST(PlanarOdometry, TinyTurnAgreesWithArc) {
  PlanarOdometry straight, arc;
  straight.set_window(1);
  arc.set_window(1);
  for (int i = 0; i < 100; ++i) {
    straight.move({1, 0.5, 0.99e-4}, 0.01);  // below the threshold
    arc.move({1, 0.5, 1.01e-4}, 0.01);
  }
  EXPECT_NEAR(straight.pose().x, arc.pose().x, 1e-6);
  EXPECT_NEAR(straight.pose().y, arc.pose().y, 2e-6);
}

}  // namespace
}  // namespace doppel
