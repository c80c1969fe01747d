// Closed forms of loops: a double integrator with delay, a servo behind a velocity command, bounds by effort.
#include "doppel/validation/tuning/loop_design.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace doppel {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

JointPlant double_integrator(double delay) {
  JointPlant out;
  out.least_inertia = out.most_inertia = 0.2;
  out.delay = delay;
  return out;
}

TEST(LoopDesign, GainsPlaceThreePoles) {
  const LoopGains gains = gains_at(double_integrator(0.001), 10);
  // (s + w)^2 (s + a w), times J.
  EXPECT_NEAR(gains.p, 0.2 * 100 * 1.5, 0.01);
  EXPECT_NEAR(gains.d, 0.2 * 10 * 2.25, 0.001);
  EXPECT_EQ(gains.i, 0);  // there is nothing to hold
  JointPlant loaded = double_integrator(0.001);
  loaded.gravity = 2;
  EXPECT_NEAR(gains_at(loaded, 10).i, 0.2 * 1000 * 0.25, 0.001);
  EXPECT_NEAR(gains_at(loaded, 10).clamp, 2.5, 1e-9);
}

TEST(LoopDesign, DampingOfJointIsPartOfDerivative) {
  JointPlant plant = double_integrator(0.001);
  plant.damping = 1;
  EXPECT_NEAR(gains_at(plant, 10).d, 0.2 * 10 * 2.25 - 1, 0.001);
  plant.damping = 100;
  EXPECT_EQ(gains_at(plant, 10).d, 0);
}

// Without an integral L = (K + D s) / (J s^2) e^(-s T); with K = J w^2, D = 2 J w the crossover is at
// w sqrt(2 + sqrt(5)), and the margin there is atan(2 wc / w) - wc T.
TEST(LoopDesign, PhaseMarginOfDelayedDoubleIntegrator) {
  const double w = 20, delay = 0.004;
  const JointPlant plant = double_integrator(delay);
  const LoopGains gains{0.2 * w * w, 0, 2 * 0.2 * w};
  const auto margins = loop_margins([&](double x) { return open_loop(plant, gains, 0.2, x); });
  ASSERT_TRUE(margins && margins->phase_margin);
  const double crossover = w * std::sqrt(2 + std::sqrt(5.0));
  EXPECT_NEAR(*margins->crossover, crossover, 1e-6 * crossover);
  EXPECT_NEAR(*margins->phase_margin, std::atan(2 * crossover / w) - crossover * delay, 1e-6);
}

TEST(LoopDesign, DelayBoundsBandwidth) {
  for (const double delay : {0.001, 0.002, 0.01}) {
    JointPlant plant = double_integrator(delay);
    plant.integral_pole = 0.001;
    const auto design = fastest_design(plant);
    ASSERT_TRUE(design);
    EXPECT_EQ(design->limit, DesignLimit::delay);
    EXPECT_GE(design->phase_margin() * kDegrees, 45);
    EXPECT_LE(design->phase_margin() * kDegrees, 47);
    EXPECT_GE(design->gain_margin(), kGainMargin);
    EXPECT_NEAR(design->bandwidth * delay, (std::atan(2 * 2.0582) - kPhaseMargin) / 2.0582, 0.01);
  }
}

TEST(LoopDesign, LeastInertiaDecidesMargins) {
  JointPlant plant = double_integrator(0.002);
  const double alone = fastest_design(plant)->bandwidth;
  plant.least_inertia = 0.05;
  const auto design = fastest_design(plant);
  ASSERT_TRUE(design);
  EXPECT_LT(design->bandwidth, 0.4 * alone);
  EXPECT_LT(*design->at_least.phase_margin, *design->at_most.phase_margin);
}

TEST(LoopDesign, EffortBoundsBandwidth) {
  JointPlant plant = double_integrator(0.0005);
  plant.effort = 4;  // 20 rad/s^2
  const auto design = fastest_design(plant);
  ASSERT_TRUE(design);
  EXPECT_EQ(design->limit, DesignLimit::effort);
  EXPECT_NEAR(design->bandwidth, 2.5 * std::sqrt(20 / 0.5), 1e-6);
  plant.speed = 1;
  EXPECT_EQ(fastest_design(plant)->limit, DesignLimit::speed);
}

TEST(LoopDesign, CeilingIsNotExceeded) {
  const auto design = fastest_design(double_integrator(0.001), 12.0);
  ASSERT_TRUE(design);
  EXPECT_NEAR(design->bandwidth, 12, 1e-9);
  EXPECT_EQ(design->limit, DesignLimit::ceiling);
}

TEST(LoopDesign, NoInertiaHasNoDesign) {
  EXPECT_FALSE(fastest_design(JointPlant{}));
}

// The bounded integral against a constant load: the loop without delay, integrated.
TEST(LoopDesign, BoundedIntegralHoldsLoadWithoutOvershoot) {
  constexpr double kStep = 1e-4;
  JointPlant plant = double_integrator(0);
  plant.gravity = 2;
  const LoopGains gains = gains_at(plant, 20);
  double y = 0, v = 0, integral = 0, peak = 0;
  for (int i = 0; i < 20000; ++i) {
    const double e = 0.5 - y;
    integral = std::clamp(integral + gains.i * e * kStep, -gains.clamp, gains.clamp);
    v += (gains.p * e + integral - gains.d * v - 2) / plant.most_inertia * kStep;
    y += v * kStep;
    peak = std::max(peak, y);
  }
  EXPECT_LT(peak, 0.5 * 1.04);
  EXPECT_NEAR(y, 0.5, 1e-3);
}

TEST(LoopDesign, VelocityLoopCrossesAtItsGain) {
  JointPlant plant = double_integrator(0.002);
  plant.kind = LoopKind::velocity;
  const auto design = design_at(plant, 8);
  ASSERT_TRUE(design);
  EXPECT_NEAR(design->gains.p, 8.04, 1e-9);
  EXPECT_NEAR(*design->at_most.crossover, 8.04, 0.02);
  EXPECT_EQ(design->gains.d, 0);
}

// J s^2 + b s behind a delay turns by half a turn where tan(w T) = b / (J w).
TEST(LoopDesign, UltimatePointOfDampedInertia) {
  JointPlant plant = double_integrator(0.005);
  plant.damping = 2;
  const auto point = ultimate_point(plant, 0.2);
  ASSERT_TRUE(point);
  const double w = 2 * std::numbers::pi / point->period;
  EXPECT_NEAR(std::tan(w * 0.005), 2 / (0.2 * w), 1e-6);
  EXPECT_NEAR(point->gain, w * std::hypot(0.2 * w, 2.0), 1e-6 * point->gain);
  plant.damping = 0;
  EXPECT_FALSE(ultimate_point(plant, 0.2));
}

// A relay as in the twin: a command of two values that is held for a period, and samples at its instants.
TEST(LoopDesign, RelayOfLagWithDelayFindsUltimatePoint) {
  constexpr double kPeriod = 1e-3, kStep = 1e-4, kTime = 0.5;
  constexpr int kDelay = 200;  // periods
  std::vector<double> commands(kDelay, 0.0), time, output;
  double y = 0;
  for (int tick = 0; tick < 20000; ++tick) {
    time.push_back(tick * kPeriod);
    output.push_back(y);
    commands.push_back(y > 0 ? -1.0 : 1.0);
    const double held = commands[static_cast<std::size_t>(tick)];
    for (int i = 0; i < 10; ++i) y += (held - y) / kTime * kStep;
  }
  const auto figures = relay_figures(time, output, {1, 0, 10});
  ASSERT_TRUE(figures);
  // The phase -pi of the lag with the delay: atan(w tau) + w L = pi.
  double low = 1, high = 100;
  for (int i = 0; i < 60; ++i) {
    const double w = 0.5 * (low + high);
    (std::atan(w * kTime) + w * kDelay * kPeriod < std::numbers::pi ? low : high) = w;
  }
  EXPECT_NEAR(figures->ultimate_period, 2 * std::numbers::pi / low, 0.05 * 2 * std::numbers::pi / low);
  EXPECT_NEAR(figures->ultimate_gain, std::hypot(1.0, low * kTime), 0.05 * std::hypot(1.0, low * kTime));
}

}  // namespace
}  // namespace doppel
