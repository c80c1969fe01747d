#include "doppel/validation/metrics/step_response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace doppel {
namespace {

// A joint of second order, w in rad/s, z < 1.
struct StepJoint {
  double w = 20, z = 0.5;

  [[nodiscard]] double answer(double t) const {
    if (t < 0) return 0;
    const double wd = w * std::sqrt(1 - z * z);
    return 1 - std::exp(-z * w * t) * (std::cos(wd * t) + z * w / wd * std::sin(wd * t));
  }

  // Bisection before the first peak.
  [[nodiscard]] double instant_of(double value) const {
    double low = 0, high = std::numbers::pi / (w * std::sqrt(1 - z * z));
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (low + high);
      (answer(middle) < value ? low : high) = middle;
    }
    return low;
  }

  [[nodiscard]] double settling(double band) const {
    double t = 20 / (z * w);
    while (std::abs(answer(t) - 1) <= band) t -= 1e-6;
    return t;
  }

  [[nodiscard]] double overshoot() const { return std::exp(-std::numbers::pi * z / std::sqrt(1 - z * z)); }
};

struct SampledStep {
  std::vector<double> time, position;
};

SampledStep sampled_step(const StepJoint& joint, double start, double height, double step_time, double rate,
                         double duration) {
  SampledStep out;
  const int count = static_cast<int>(duration * rate);
  for (int i = 0; i <= count; ++i) {
    out.time.push_back(i / rate);
    out.position.push_back(start + height * joint.answer(out.time.back() - step_time));
  }
  return out;
}

void expect_ratio(double value, double theory, double tolerance) {
  EXPECT_NEAR(value / theory, 1, tolerance) << value << " instead of " << theory;
}

TEST(StepResponse, SecondOrderJointGivesClosedForm) {
  for (const double rate : {100.0, 1000.0})
    for (const double height : {0.5, -0.5})
      for (const StepJoint joint : {StepJoint{8, 0.3}, {10, 0.5}, {12, 0.65}, {16, 0.75}}) {
        SCOPED_TRACE(testing::Message()
                     << rate << " Hz, height " << height << ", w " << joint.w << ", z " << joint.z);
        const auto samples = sampled_step(joint, 0.2, height, 0.1, rate, 4.1);
        const auto figures = step_figures(samples.time, samples.position, 0.2 + height, {.step_time = 0.1});
        ASSERT_TRUE(figures);
        EXPECT_TRUE(figures->reached);
        EXPECT_TRUE(figures->settled);
        expect_ratio(figures->rise, joint.instant_of(0.9) - joint.instant_of(0.1), 0.005);
        expect_ratio(figures->overshoot, joint.overshoot(), 0.005);
        expect_ratio(figures->settling, joint.settling(0.02), 0.005);
        expect_ratio(figures->peak_time, std::numbers::pi / (joint.w * std::sqrt(1 - joint.z * joint.z)),
                     0.005);
        EXPECT_NEAR(figures->error, 0, 1e-4);
        EXPECT_NEAR(figures->height, height, 1e-12);
      }
}

TEST(StepResponse, FastJointAtKilohertzGivesClosedForm) {
  const StepJoint joint{60, 0.4};
  const auto samples = sampled_step(joint, 0, 0.5, 0, 1000, 2);
  const auto figures = step_figures(samples.time, samples.position, 0.5);
  ASSERT_TRUE(figures);
  expect_ratio(figures->rise, joint.instant_of(0.9) - joint.instant_of(0.1), 0.005);
  expect_ratio(figures->overshoot, joint.overshoot(), 0.005);
  expect_ratio(figures->settling, joint.settling(0.02), 0.005);
}

TEST(StepResponse, SameStepScaledAndMirroredGivesSameRatios) {
  constexpr unsigned kSeed = 20261128;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> damping(0.2, 0.8), frequency(6, 30), scale(-2, 2), shift(-3, 3);
  for (int run = 0; run < 50; ++run) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", run " << run);
    const StepJoint joint{frequency(random), damping(random)};
    const double height = scale(random), start = shift(random);
    const auto unit = sampled_step(joint, 0, 1, 0, 500, 5);
    const auto other = sampled_step(joint, start, height, 0, 500, 5);
    const auto a = step_figures(unit.time, unit.position, 1);
    const auto b = step_figures(other.time, other.position, start + height);
    ASSERT_TRUE(a && b);
    EXPECT_NEAR(a->rise, b->rise, 1e-9);
    EXPECT_NEAR(a->overshoot, b->overshoot, 1e-9);
    EXPECT_NEAR(a->settling, b->settling, 1e-9);
    EXPECT_NEAR(a->error * std::abs(height), b->error, 1e-9);
  }
}

TEST(StepResponse, SagBelowTargetGivesErrorAndNoOvershoot) {
  std::vector<double> time, position;
  for (int i = 0; i <= 1000; ++i) {
    time.push_back(i * 1e-3);
    position.push_back(0.45 * (1 - std::exp(-time.back() / 0.05)));
  }
  const auto figures = step_figures(time, position, 0.5);
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->error, 0.05, 1e-6);
  EXPECT_EQ(figures->overshoot, 0);
  EXPECT_FALSE(figures->reached);
  EXPECT_TRUE(figures->settled);
  // 0.45 exp(-t / 0.05) = 0.02 * 0.5.
  EXPECT_NEAR(figures->settling, 0.05 * std::log(45), 1e-5);
}

TEST(StepResponse, OscillationUntilEndIsNotSettled) {
  const StepJoint joint{10, 0.001};
  const auto samples = sampled_step(joint, 0, 1, 0, 1000, 3);
  const auto figures = step_figures(samples.time, samples.position, 1);
  ASSERT_TRUE(figures);
  EXPECT_FALSE(figures->settled);
  EXPECT_TRUE(figures->reached);
}

TEST(StepResponse, ConstantSignalReachesNothing) {
  const std::vector<double> time{0, 0.1, 0.2, 0.3}, position(4, 1.0);
  const auto figures = step_figures(time, position, 2);
  ASSERT_TRUE(figures);
  EXPECT_FALSE(figures->reached);
  EXPECT_TRUE(figures->settled);
  EXPECT_EQ(figures->error, 1);
  EXPECT_EQ(figures->rise, 0);
  EXPECT_FALSE(step_figures(time, position, 1));  // no step
}

TEST(StepResponse, ImmediateJumpGivesRiseWithinOnePeriod) {
  const std::vector<double> time{0, 0.1, 0.2, 0.3, 0.4}, position{0, 1, 1, 1, 1};
  const auto figures = step_figures(time, position, 1);
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->rise, 0.08, 1e-12);
  EXPECT_NEAR(figures->settling, 0.098, 1e-12);
  EXPECT_EQ(figures->overshoot, 0);
}

TEST(StepResponse, BadSamplesGiveNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> time{0, 0.1, 0.2, 0.3}, position{0, 0.5, 1, 1};
  EXPECT_FALSE(step_figures({}, {}, 1));
  EXPECT_FALSE(step_figures(time, std::vector<double>{0, 1}, 1));
  EXPECT_FALSE(step_figures(time, std::vector<double>{0, nan, 1, 1}, 1));
  EXPECT_FALSE(step_figures(std::vector<double>{0, 0.1, 0.1, 0.3}, position, 1));
  EXPECT_FALSE(step_figures(time, position, nan));
  EXPECT_FALSE(step_figures(time, position, 1, {.step_time = 0.25}));  // one sample remains
  EXPECT_FALSE(step_coupling(time, std::vector<double>{0, nan, 1, 1}));
}

TEST(StepCoupling, DisturbedJointGivesLargestMotionAfterStep) {
  const std::vector<double> time{0, 1, 2, 3, 4}, position{9, 0.5, 0.52, 0.47, 0.5};
  EXPECT_NEAR(step_coupling(time, position, 1).value(), 0.03, 1e-12);
}

}  // namespace
}  // namespace doppel
