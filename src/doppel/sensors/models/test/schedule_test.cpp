#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "doppel/sensors/models/sample_schedule.h"
#include "doppel/sensors/models/scan_pattern.h"

namespace doppel {
namespace {

constexpr Duration kStep{1'000'000};

// An edit of the world's step while it runs.
TEST(SampleSchedule, AnotherStepKeepsRateAndNumbers) {
  constexpr Duration kLonger{2'000'000}, kShorter{500'000};
  for (const Duration step : {kLonger, kShorter}) {
    SampleSchedule at_rate(50.0, kStep), every_step(0.0, kStep);
    at_rate.restart(Time{});
    every_step.restart(Time{});
    Time now{};
    for (int i = 0; i < 1000; ++i) {
      now += kStep;
      if (at_rate.due(now)) at_rate.take(now);
      if (every_step.due(now)) every_step.take(now);
    }
    at_rate = at_rate.continued(50.0, step, now);
    every_step = every_step.continued(0.0, step, now);
    EXPECT_EQ(at_rate.next(), 50u);
    EXPECT_EQ(every_step.next(), 1000u);
    int samples = 0, steps = 0;
    for (const Time end = now + Duration{1'000'000'000}; now < end; ++steps) {
      now += step;
      if (at_rate.due(now)) samples += at_rate.take(now) == static_cast<std::uint64_t>(50 + samples);
      ASSERT_TRUE(every_step.due(now));
      EXPECT_EQ(every_step.take(now), static_cast<std::uint64_t>(1000 + steps));
    }
    EXPECT_EQ(samples, 50);
  }
}

TEST(SampleSchedule, CountsAreExactAndStampsWithinHalfStep) {
  for (const double rate : {30.0, 60.0, 7.0, 333.0}) {
    SampleSchedule schedule(rate, kStep);
    schedule.restart(Time{});
    int count = 0;
    for (Time now{kStep}; now <= Time{Duration{10'000'000'000}}; now += kStep) {
      if (!schedule.due(now)) continue;
      const std::uint64_t n = schedule.take(now);
      EXPECT_EQ(n, static_cast<std::uint64_t>(count));
      const double exact = static_cast<double>(n + 1) / rate * 1e9;
      EXPECT_LE(std::abs(static_cast<double>((now - Time{}).count()) - exact), 500'000 + 1);
      ++count;
    }
    EXPECT_EQ(count, static_cast<int>(10 * rate)) << rate;
    EXPECT_FALSE(schedule.limited());
  }
}

TEST(SampleSchedule, RateOfZeroAndRateAboveStepsIsEveryStep) {
  for (const double rate : {0.0, 1500.0}) {
    SampleSchedule schedule(rate, kStep);
    schedule.restart(Time{});
    int count = 0;
    for (Time now{kStep}; now <= Time{Duration{1'000'000'000}}; now += kStep) {
      if (schedule.due(now)) {
        schedule.take(now);
        ++count;
      }
    }
    EXPECT_EQ(count, 1000);
    EXPECT_EQ(schedule.limited(), rate > 0);
  }
}

TEST(SampleSchedule, SamplesWhoseTimeHasPassedAreSkipped) {
  SampleSchedule schedule(100, kStep);
  schedule.restart(Time{});
  EXPECT_EQ(schedule.take(Time{Duration{55'000'000}}), 4U);
  EXPECT_EQ(schedule.next(), 5U);
}

TEST(ScanPattern, IncrementSpansFromMinToMax) {
  LidarDescription lidar;
  lidar.horizontal = {360, 2, -3, 3};
  lidar.vertical = {16, 1, -0.25, 0.25};
  const ScanPattern pattern = scan_pattern(lidar);
  EXPECT_EQ(pattern.columns, 720);
  EXPECT_EQ(pattern.rings, 16);
  EXPECT_NEAR(pattern.angle_increment, 6.0 / 719, 1e-12);
  EXPECT_EQ(pattern.middle_ring(), 8);
  const Eigen::Vector3f last = pattern.direction(pattern.size() - 1);
  EXPECT_NEAR(std::atan2(last.y(), last.x()), 3, 1e-6);
  EXPECT_NEAR(std::asin(last.z()), 0.25, 1e-6);
}

TEST(ScanPattern, MovingScanCastsEachColumnFromItsOwnTime) {
  LidarDescription lidar;
  lidar.horizontal = {4, 1, 0, 2.4};
  lidar.vertical = {1, 1, 0, 0};
  const ScanPattern pattern = scan_pattern(lidar);
  PoseMotion link;  // at the end of a scan of 0.1 s
  link.X_WF.translation() = Eigen::Vector3d(4, 0, 0);
  link.X_WF.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  link.linear_W.x() = 40;
  link.angular_W.z() = 4;
  RayBatch rays;
  place_rays(pattern, link, Pose::Identity(), 0.1, rays);
  ASSERT_EQ(rays.origin_x.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(rays.origin_x[i], static_cast<double>(i), 1e-6);
    EXPECT_NEAR(std::atan2(rays.direction_y[i], rays.direction_x[i]), 0.9 * static_cast<double>(i), 1e-5);
  }
  place_rays(pattern, {link.X_WF}, Pose::Identity(), 0.1, rays);
  EXPECT_EQ(rays.origin_x.size(), 1U);
}

}  // namespace
}  // namespace doppel
