#include "doppel/validation/metrics/relay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace doppel {
namespace {

// K exp(-L s) / (T s + 1).
struct DelayedLag {
  double gain = 1, lag = 1, delay = 0.1;

  [[nodiscard]] double ultimate_frequency() const {
    double low = 0, high = std::numbers::pi / delay;
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (low + high);
      (middle * delay + std::atan(middle * lag) < std::numbers::pi ? low : high) = middle;
    }
    return low;
  }
  [[nodiscard]] double ultimate_gain() const { return std::hypot(1, ultimate_frequency() * lag) / gain; }
};

struct RelayRun {
  std::vector<double> time, output;
};

// The relay acts on -output, decided and held for a step; the step is exact.
RelayRun relay_run(const DelayedLag& plant, const RelayOptions& relay, double duration, double step) {
  RelayRun out;
  const int steps = static_cast<int>(duration / step);
  const auto late = static_cast<std::size_t>(std::lround(plant.delay / step));
  std::vector<double> efforts(late, 0.0);
  double y = 0, effort = relay.amplitude;
  const double decay = std::exp(-step / plant.lag);
  for (int i = 0; i < steps; ++i) {
    out.time.push_back(i * step);
    out.output.push_back(y);
    if (-y > relay.hysteresis) effort = relay.amplitude;
    if (-y < -relay.hysteresis) effort = -relay.amplitude;
    efforts.push_back(effort);
    y = decay * y + (1 - decay) * plant.gain * efforts[efforts.size() - 1 - late];
  }
  return out;
}

TEST(Relay, LagWithDelayGivesUltimateGainAndPeriod) {
  for (const double ratio : {0.05, 0.1, 0.3, 1.0, 2.0}) {
    SCOPED_TRACE(testing::Message() << "delay / lag " << ratio);
    const DelayedLag plant{2.5, 0.4, 0.4 * ratio};
    const RelayOptions relay{.amplitude = 3, .hysteresis = 0, .begin = 20 * plant.delay};
    const auto run = relay_run(plant, relay, 60 * plant.delay, plant.delay / 200);
    const auto figures = relay_figures(run.time, run.output, relay);
    ASSERT_TRUE(figures);
    const double turn = 2 * std::numbers::pi;
    EXPECT_NEAR(figures->ultimate_gain / plant.ultimate_gain(), 1, 0.05);
    EXPECT_NEAR(figures->ultimate_period / (turn / plant.ultimate_frequency()), 1, 0.05);
    // The limit cycle itself has closed forms.
    const double growth = std::exp(ratio);
    EXPECT_NEAR(figures->ultimate_period / (2 * plant.lag * std::log(2 * growth - 1)), 1, 0.01);
    EXPECT_NEAR(figures->half_range / (plant.gain * 3 * (1 - 1 / growth)), 1, 0.01);
    EXPECT_NEAR(figures->peak_gain, 12 / (std::numbers::pi * figures->half_range), 1e-9);
    EXPECT_LT(figures->period_spread, 0.01);
    EXPECT_GE(figures->cycles, 5);
  }
}

TEST(Relay, SmallHysteresisKeepsUltimateGain) {
  const DelayedLag plant{1, 1, 0.5};
  const RelayOptions relay{.amplitude = 1, .hysteresis = 0.02, .begin = 5};
  const auto run = relay_run(plant, relay, 30, 1e-3);
  const auto figures = relay_figures(run.time, run.output, relay);
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->ultimate_gain / plant.ultimate_gain(), 1, 0.05);
}

TEST(Relay, NoiseOfOutputAddsNoCycles) {
  constexpr unsigned kSeed = 5;
  std::mt19937 random(kSeed);
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  const DelayedLag plant{1, 1, 0.5};
  const RelayOptions relay{.amplitude = 1, .hysteresis = 0, .begin = 5};
  auto run = relay_run(plant, relay, 30, 1e-3);
  const auto clean = relay_figures(run.time, run.output, relay);
  std::normal_distribution<double> noise(0, 0.01);
  for (double& value : run.output) value += noise(random);
  const auto noisy = relay_figures(run.time, run.output, relay);
  ASSERT_TRUE(clean && noisy);
  EXPECT_EQ(noisy->cycles, clean->cycles);
  EXPECT_NEAR(noisy->ultimate_gain / clean->ultimate_gain, 1, 0.01);
  EXPECT_NEAR(noisy->ultimate_period / clean->ultimate_period, 1, 0.01);
}

TEST(Relay, SineGivesItsAmplitudeAndPeriod) {
  std::vector<double> time, output;
  for (int i = 0; i < 1000; ++i) {
    time.push_back(i * 0.01);
    output.push_back(0.7 + 0.2 * std::sin(2 * std::numbers::pi * time.back() / 1.3));
  }
  const auto figures = relay_figures(time, output, {.amplitude = 1, .hysteresis = 0.12});
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->fundamental, 0.2, 1e-4);
  EXPECT_NEAR(figures->half_range, 0.2, 1e-4);
  EXPECT_NEAR(figures->ultimate_period, 1.3, 1e-4);
  EXPECT_NEAR(figures->ultimate_gain, 4 / (std::numbers::pi * 0.16), 5e-3);
}

TEST(Relay, SignalsWithoutCyclesGiveNone) {
  const std::vector<double> time{0, 1, 2, 3, 4}, constant(5, 1.0), once{0, 1, 0, 1, 1};
  const RelayOptions relay{.amplitude = 1};
  EXPECT_FALSE(relay_figures({}, {}, relay));
  EXPECT_FALSE(relay_figures(time, constant, relay));
  EXPECT_FALSE(relay_figures(time, once, relay));
  EXPECT_FALSE(relay_figures(time, once, {}));
  EXPECT_FALSE(relay_figures(time, std::vector<double>{0, 1, std::nan(""), 1, 0}, relay));
  EXPECT_FALSE(relay_figures(time, once, {.amplitude = 1, .begin = 9}));
}

TEST(Relay, AmplitudeWithinHysteresisGivesNone) {
  std::vector<double> time, output;
  for (int i = 0; i < 1000; ++i) {
    time.push_back(i * 0.01);
    output.push_back(std::sin(time.back() * 10));
  }
  EXPECT_TRUE(relay_figures(time, output, {.amplitude = 1, .hysteresis = 0.9}));
  EXPECT_FALSE(relay_figures(time, output, {.amplitude = 1, .hysteresis = 1.1}));
}

TEST(TuningRules, GainAndPeriodGiveTables) {
  const auto zn = gains_by_rule(TuningRule::ziegler_nichols, 10, 2);
  ASSERT_TRUE(zn);
  EXPECT_NEAR(zn->p, 6, 1e-12);
  EXPECT_NEAR(zn->i, 6, 1e-12);
  EXPECT_NEAR(zn->d, 1.5, 1e-12);
  const auto tl = gains_by_rule(TuningRule::tyreus_luyben, 10, 2);
  ASSERT_TRUE(tl);
  EXPECT_NEAR(tl->p, 10 / 2.2, 1e-12);
  EXPECT_NEAR(tl->i, 10 / 2.2 / 4.4, 1e-12);
  EXPECT_NEAR(tl->d, 20 / 2.2 / 6.3, 1e-12);
  const auto calm = gains_by_rule(TuningRule::no_overshoot, 10, 2);
  ASSERT_TRUE(calm);
  EXPECT_NEAR(calm->p, 2, 1e-12);
  EXPECT_NEAR(calm->i, 2, 1e-12);
  EXPECT_NEAR(calm->d, 4.0 / 3, 1e-12);
  EXPECT_FALSE(gains_by_rule(TuningRule::no_overshoot, 0, 2));
  EXPECT_FALSE(gains_by_rule(TuningRule::no_overshoot, 1, std::nan("")));
  EXPECT_STREQ(name_of(TuningRule::tyreus_luyben), "Tyreus-Luyben");
}

}  // namespace
}  // namespace doppel
