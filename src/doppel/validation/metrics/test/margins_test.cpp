#include "doppel/validation/metrics/margins.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace doppel {
namespace {

using Complex = std::complex<double>;
constexpr double kHalfTurn = std::numbers::pi;

TEST(LoopMargins, ThreeEqualLagsGiveClosedForm) {
  // k / (s + 1)^3: phase -180 degrees at sqrt(3), where the gain is k / 8.
  const double k = 4;
  const auto loop = [&](double w) { return k / std::pow(Complex(1, w), 3); };
  const auto margins = loop_margins(loop);
  ASSERT_TRUE(margins && margins->gain_margin && margins->phase_margin);
  EXPECT_TRUE(margins->stable);
  EXPECT_NEAR(*margins->gain_margin, 2, 1e-9);
  EXPECT_NEAR(*margins->gain_margin_frequency, std::sqrt(3), 1e-9);
  const double w = std::sqrt(std::pow(k, 2.0 / 3) - 1);
  EXPECT_NEAR(*margins->crossover, w, 1e-9);
  EXPECT_NEAR(*margins->phase_margin, kHalfTurn - 3 * std::atan(w), 1e-9);
  EXPECT_NEAR(*margins->delay_margin, (kHalfTurn - 3 * std::atan(w)) / w, 1e-9);
  EXPECT_FALSE(margins->lowest_gain);
}

TEST(LoopMargins, IntegratorWithDelayGivesClosedForm) {
  // k exp(-s L) / s: crossover k, phase margin pi / 2 - k L, gain margin pi / (2 k L).
  constexpr unsigned kSeed = 42;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> gain(0.5, 50), part(0.05, 1.4);
  for (int run = 0; run < 50; ++run) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", run " << run);
    const double k = gain(random), delay = part(random) / k;
    const auto loop = [&](double w) { return k * std::polar(1.0, -w * delay) / Complex(0, w); };
    const auto margins = loop_margins(loop, {.low = 1e-2, .high = 1e4});
    ASSERT_TRUE(margins && margins->gain_margin && margins->phase_margin);
    EXPECT_TRUE(margins->stable);
    EXPECT_NEAR(*margins->crossover / k, 1, 1e-9);
    EXPECT_NEAR(*margins->phase_margin, kHalfTurn / 2 - k * delay, 1e-9);
    EXPECT_NEAR(*margins->gain_margin, kHalfTurn / (2 * k * delay), 1e-6);
    EXPECT_NEAR(*margins->delay_margin, kHalfTurn / 2 / k - delay, 1e-9);
  }
}

TEST(LoopMargins, TooMuchGainIsUnstableWithFactorBelowOne) {
  const auto loop = [](double w) { return 16.0 / std::pow(Complex(1, w), 3); };
  const auto margins = loop_margins(loop);
  ASSERT_TRUE(margins && margins->gain_margin && margins->phase_margin);
  EXPECT_FALSE(margins->stable);
  EXPECT_NEAR(*margins->gain_margin, 0.5, 1e-9);
  EXPECT_LT(*margins->phase_margin, 0);
  EXPECT_FALSE(margins->delay_margin);
}

TEST(LoopMargins, ConditionallyStableLoopGivesBothGainLimits) {
  // k (s + 1)^2 / s^3: phase -180 degrees at 1, where the gain is 2 k; stable above k = 0.5.
  const auto loop = [](double w) { return 2.0 * std::pow(Complex(1, w), 2) / std::pow(Complex(0, w), 3); };
  const auto margins = loop_margins(loop);
  ASSERT_TRUE(margins);
  EXPECT_TRUE(margins->stable);
  EXPECT_FALSE(margins->gain_margin);
  ASSERT_TRUE(margins->lowest_gain);
  EXPECT_NEAR(*margins->lowest_gain, 0.25, 1e-9);
  const auto weak =
      loop_margins([](double w) { return 0.4 * std::pow(Complex(1, w), 2) / std::pow(Complex(0, w), 3); });
  ASSERT_TRUE(weak);
  EXPECT_FALSE(weak->stable);
}

TEST(LoopMargins, FirstOrderLoopHasNoGainLimit) {
  const auto margins = loop_margins([](double w) { return 10.0 / Complex(1, w); });
  ASSERT_TRUE(margins && margins->phase_margin);
  EXPECT_TRUE(margins->stable);
  EXPECT_FALSE(margins->gain_margin);
  EXPECT_NEAR(*margins->crossover, std::sqrt(99.0), 1e-9);
  EXPECT_NEAR(*margins->phase_margin, kHalfTurn - std::atan(std::sqrt(99.0)), 1e-9);
  EXPECT_NEAR(margins->max_sensitivity, 1, 1e-3);
}

TEST(LoopMargins, WeakLoopHasNoCrossover) {
  const auto margins = loop_margins([](double w) { return 0.5 / Complex(1, w); });
  ASSERT_TRUE(margins);
  EXPECT_TRUE(margins->stable);
  EXPECT_FALSE(margins->phase_margin);
  EXPECT_FALSE(margins->crossover);
}

TEST(LoopMargins, ResonanceGivesEachCrossoverAndWorstOne) {
  // An integrator of 1 rad/s with a resonance at 10 rad/s whose peak is 1 / (10 * 2 * 0.01) = 5.
  const auto loop = [](double w) {
    const Complex s(0, w);
    return 1.0 / s * 100.0 / (s * s + 0.2 * s + 100.0);
  };
  const auto margins = loop_margins(loop);
  ASSERT_TRUE(margins && margins->gain_margin);
  EXPECT_EQ(margins->gain_crossovers.size(), 3U);
  EXPECT_FALSE(margins->stable);  // phase -180 degrees at 10 rad/s
  EXPECT_NEAR(*margins->gain_margin, 0.2, 1e-6);
}

TEST(LoopMargins, SensitivityOfSecondOrderLoopGivesSearchedMaximum) {
  const auto loop = [](double w) { return 25.0 / (Complex(0, w) * Complex(5, w)); };
  const auto margins = loop_margins(loop, {.low = 0.01, .high = 1e3, .points_per_decade = 30});
  ASSERT_TRUE(margins);
  double largest = 0;
  for (int i = 0; i < 2000000; ++i) largest = std::max(largest, 1 / std::abs(1.0 + loop(1 + i * 1e-5)));
  EXPECT_NEAR(margins->max_sensitivity, largest, 1e-8);
}

TEST(LoopMargins, BadSearchOrLoopGivesNone) {
  const auto loop = [](double w) { return 1.0 / Complex(1, w); };
  EXPECT_FALSE(loop_margins({}));
  EXPECT_FALSE(loop_margins(loop, {.low = 0}));
  EXPECT_FALSE(loop_margins(loop, {.low = 2, .high = 1}));
  EXPECT_FALSE(loop_margins(loop, {.points_per_decade = 0}));
  EXPECT_FALSE(loop_margins([](double) { return Complex(std::nan(""), 0); }));
}

}  // namespace
}  // namespace doppel
