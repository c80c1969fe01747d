#include "doppel/validation/metrics/stopping.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace doppel {
namespace {

struct SampledStop {
  std::vector<double> time, position, speed;
};

// Constant deceleration from `trigger` on, then rest.
SampledStop sampled_stop(double initial_speed, double deceleration, double trigger, double rate) {
  SampledStop out;
  const double sign = initial_speed < 0 ? -1 : 1, end = std::abs(initial_speed) / deceleration;
  const int count = static_cast<int>((trigger + end + 0.2) * rate);
  for (int i = 0; i <= count; ++i) {
    const double t = i / rate, s = std::clamp(t - trigger, 0.0, end);
    out.time.push_back(t);
    out.position.push_back(0.3 + initial_speed * std::min(t, trigger) + initial_speed * s -
                           0.5 * sign * deceleration * s * s);
    out.speed.push_back(initial_speed - sign * deceleration * s);
  }
  return out;
}

TEST(Stopping, FrictionAloneGivesDistanceByEnergy) {
  for (const double rate : {100.0, 1000.0})
    for (const double speed : {2.0, -2.0}) {
      const double inertia = 0.05, friction = 0.4;  // kg m^2, N m
      const auto samples = sampled_stop(speed, friction / inertia, 0.1003, rate);
      const auto figures = stop_figures(samples.time, samples.position, samples.speed, {.stop_time = 0.1003});
      ASSERT_TRUE(figures);
      EXPECT_TRUE(figures->stopped);
      EXPECT_NEAR(figures->distance, inertia * speed * speed / (2 * friction), 2.5e-5);
      EXPECT_NEAR(figures->time, std::abs(speed) * inertia / friction, 2e-4);
      EXPECT_NEAR(figures->initial_speed, speed, 3e-3);  // linear across the trigger
      EXPECT_NEAR(figures->largest_way, figures->distance, 1e-6);
    }
}

TEST(Stopping, RandomDecelerationsGiveClosedFormWithinOnePercent) {
  constexpr unsigned kSeed = 9283;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> speed(0.5, 4), deceleration(2, 20), trigger(0, 0.3);
  for (int run = 0; run < 200; ++run) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", run " << run);
    const double v = speed(random), a = deceleration(random), t = trigger(random);
    const auto samples = sampled_stop(v, a, t, 500);
    const auto figures = stop_figures(samples.time, samples.position, samples.speed, {.stop_time = t});
    ASSERT_TRUE(figures);
    EXPECT_NEAR(figures->distance / (0.5 * v * v / a), 1, 0.01);
    EXPECT_NEAR(figures->time / (v / a), 1, 0.01);
  }
}

TEST(Stopping, SwingBackCountsUntilItsEnd) {
  const std::vector<double> time{0, 1, 2, 3, 4, 5}, position{0, 1, 1.2, 0.7, 0.2, 0.2},
      speed{1, 0, -0.5, -0.5, 0, 0};
  const auto figures = stop_figures(time, position, speed, {.stop_time = 0, .threshold = 0.1});
  ASSERT_TRUE(figures);
  EXPECT_TRUE(figures->stopped);
  EXPECT_NEAR(figures->time, 3.8, 1e-12);
  EXPECT_NEAR(figures->largest_way, 1.2, 1e-12);
}

TEST(Stopping, EndlessMotionGivesLowerBounds) {
  const std::vector<double> time{0, 1, 2}, position{0, 1, 2}, speed{1, 1, 1};
  const auto figures = stop_figures(time, position, speed);
  ASSERT_TRUE(figures);
  EXPECT_FALSE(figures->stopped);
  EXPECT_EQ(figures->time, 2);
  EXPECT_EQ(figures->distance, 2);
}

TEST(Stopping, JointAtRestStopsAtOnce) {
  const std::vector<double> time{0, 1, 2}, position{1, 1, 1}, speed{0, 0, 0};
  const auto figures = stop_figures(time, position, speed);
  ASSERT_TRUE(figures);
  EXPECT_TRUE(figures->stopped);
  EXPECT_EQ(figures->time, 0);
  EXPECT_EQ(figures->distance, 0);
}

TEST(Stopping, BadSamplesGiveNone) {
  const std::vector<double> time{0, 1}, values{0, 0};
  EXPECT_FALSE(stop_figures({}, {}, {}));
  EXPECT_FALSE(stop_figures(time, values, std::vector<double>{0, std::numeric_limits<double>::infinity()}));
  EXPECT_FALSE(stop_figures(time, values, std::vector<double>{0}));
  EXPECT_FALSE(stop_figures(time, values, values, {.stop_time = 1}));
  EXPECT_FALSE(stop_figures(time, values, values, {.threshold = 0}));
}

}  // namespace
}  // namespace doppel
