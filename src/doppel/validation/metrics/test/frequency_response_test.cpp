#include "doppel/validation/metrics/frequency_response.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace doppel {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

// A joint of second order; frequency in Hz.
struct SweptJoint {
  double natural = 5, damping = 0.7;

  [[nodiscard]] std::complex<double> response(double frequency) const {
    const std::complex<double> s(0, frequency / natural);
    return 1.0 / (s * s + 2 * damping * s + 1.0);
  }

  [[nodiscard]] double bandwidth() const {
    const double c = 1 - 2 * damping * damping;
    return natural * std::sqrt(c + std::sqrt(c * c + 1));
  }
};

struct SweptSamples {
  std::vector<double> input, output;
};

// Runge and Kutta's fourth order at 10 kHz, sampled at `rate`, with a second of rest after the sweep.
SweptSamples swept(const SweptJoint& joint, const SineSweep& sweep, int rate) {
  const double h = 1e-4, w = kTwoPi * joint.natural;
  const int steps = static_cast<int>((sweep.end() + 1) / h), each = 10000 / rate;
  double x = 0, v = 0;
  const auto a = [&](double t, double position, double speed) {
    return w * w * (sweep.position_at(t) - position) - 2 * joint.damping * w * speed;
  };
  SweptSamples out;
  for (int i = 0; i < steps; ++i) {
    const double t = i * h;
    if (i % each == 0) {
      out.input.push_back(sweep.position_at(t));
      out.output.push_back(x);
    }
    const double v1 = v, a1 = a(t, x, v);
    const double v2 = v + 0.5 * h * a1, a2 = a(t + 0.5 * h, x + 0.5 * h * v1, v2);
    const double v3 = v + 0.5 * h * a2, a3 = a(t + 0.5 * h, x + 0.5 * h * v2, v3);
    const double v4 = v + h * a3, a4 = a(t + h, x + h * v3, v4);
    x += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return out;
}

TEST(SineSweep, CommandBeginsAndEndsAtZeroWithContinuousPhase) {
  const SineSweep sweep;
  EXPECT_TRUE(sweep.valid());
  EXPECT_GE(sweep.end(), 30);
  EXPECT_LT(sweep.end(), 30 + 1 / sweep.high);
  EXPECT_NEAR(sweep.position_at(sweep.end() * (1 - 1e-12)), 0, 1e-6);
  EXPECT_NEAR(sweep.frequency_at(30), 20, 1e-9);
  double jump = 0;
  for (int i = -10; i < 31000; ++i)
    jump = std::max(jump, std::abs(sweep.position_at(i * 1e-3 + 1e-3) - sweep.position_at(i * 1e-3)));
  EXPECT_LE(jump, sweep.max_speed() * 1e-3);
}

TEST(SineSweep, ImpossibleFrequenciesAreNotValid) {
  EXPECT_FALSE((SineSweep{.low = 0}.valid()));
  EXPECT_FALSE((SineSweep{.low = 20}.valid()));
  EXPECT_FALSE((SineSweep{.duration = -1}.valid()));
  EXPECT_FALSE((SineSweep{.amplitude = std::numeric_limits<double>::quiet_NaN()}.valid()));
}

TEST(FrequencyResponse, SecondOrderJointGivesClosedForm) {
  for (const SweptJoint joint : {SweptJoint{0.5, 0.7}, {1, 0.3}, {2, 0.5}, {5, 0.7}, {8, 0.4}, {8, 1}})
    for (const int rate : {100, 1000}) {
      SCOPED_TRACE(testing::Message()
                   << joint.natural << " Hz, z " << joint.damping << ", " << rate << " Hz");
      const auto samples = swept(joint, {}, rate);
      const auto response = frequency_response(samples.input, samples.output, rate);
      ASSERT_TRUE(response);
      for (const FrequencyPoint& point : *response) {
        const auto theory = joint.response(point.frequency);
        if (point.frequency > 15 || std::abs(theory) < 0.05) continue;
        EXPECT_NEAR(point.magnitude / std::abs(theory), 1, 0.005) << point.frequency;
        EXPECT_NEAR(std::remainder(point.phase - std::arg(theory), kTwoPi), 0, 0.01) << point.frequency;
        EXPECT_GT(point.coherence, 0.99);
      }
      const auto band = bandwidth_of(*response);
      ASSERT_TRUE(band && band->frequency);
      EXPECT_NEAR(*band->frequency / joint.bandwidth(), 1, 0.005);
      EXPECT_NEAR(band->phase, std::arg(joint.response(joint.bandwidth())), 0.01);
      if (joint.damping > 0.6) continue;
      const double z = joint.damping;
      EXPECT_NEAR(band->peak_magnitude * 2 * z * std::sqrt(1 - z * z), 1, 0.005);
      EXPECT_NEAR(band->peak_frequency / (joint.natural * std::sqrt(1 - 2 * z * z)), 1, 0.01);
    }
}

TEST(FrequencyResponse, SegmentsWithWindowGiveBandwidthOfFastJoint) {
  const SweptJoint joint{8, 0.4};
  const auto samples = swept(joint, {}, 500);
  const auto response = frequency_response(samples.input, samples.output, 500, {.segment = 20});
  ASSERT_TRUE(response);
  EXPECT_NEAR(*bandwidth_of(*response)->frequency / joint.bandwidth(), 1, 0.005);
}

TEST(FrequencyResponse, NoiseOfOutputLowersCoherenceAndKeepsBandwidth) {
  constexpr unsigned kSeed = 77;
  std::mt19937 random(kSeed);
  for (int run = 0; run < 5; ++run) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", run " << run);
    const SweptJoint joint{4, 0.6};
    auto samples = swept(joint, {}, 500);
    std::normal_distribution<double> noise(0, 5e-4);  // 1 % of the amplitude
    for (double& value : samples.output) value += noise(random);
    const auto response = frequency_response(samples.input, samples.output, 500);
    ASSERT_TRUE(response);
    const auto band = bandwidth_of(*response);
    ASSERT_TRUE(band && band->frequency);
    EXPECT_NEAR(*band->frequency / joint.bandwidth(), 1, 0.02);
    EXPECT_LT(response->back().coherence, 0.999);
  }
}

TEST(FrequencyResponse, OffsetOfOutputDoesNotCount) {
  const SweptJoint joint{5, 0.7};
  auto samples = swept(joint, {}, 200);
  for (double& value : samples.output) value += 1.5;
  for (double& value : samples.input) value += 1.6;
  const auto response = frequency_response(samples.input, samples.output, 200);
  ASSERT_TRUE(response);
  EXPECT_NEAR(*bandwidth_of(*response)->frequency / joint.bandwidth(), 1, 0.005);
}

TEST(FrequencyResponse, OutputEqualToInputGivesOne) {
  const auto samples = swept({}, {}, 100);
  const auto response = frequency_response(samples.input, samples.input, 100);
  ASSERT_TRUE(response);
  for (const FrequencyPoint& point : *response) {
    EXPECT_NEAR(point.magnitude, 1, 1e-9);
    EXPECT_NEAR(point.phase, 0, 1e-9);
    EXPECT_NEAR(point.coherence, 1, 1e-9);
  }
  const auto band = bandwidth_of(*response);
  ASSERT_TRUE(band);
  EXPECT_FALSE(band->frequency);
}

TEST(FrequencyResponse, BadSignalsGiveNone) {
  std::vector<double> rising(3000), constant(3000, 1.0);
  for (std::size_t i = 0; i < rising.size(); ++i) rising[i] = 1e-3 * static_cast<double>(i);
  EXPECT_TRUE(frequency_response(rising, constant, 100));
  EXPECT_FALSE(frequency_response({}, {}, 100));
  EXPECT_FALSE(frequency_response(constant, rising, 100));
  EXPECT_FALSE(frequency_response(rising, std::span(rising).first(10), 100));
  EXPECT_FALSE(frequency_response(rising, rising, 30));    // 20 Hz is above half the rate
  EXPECT_FALSE(frequency_response(rising, rising, 1000));  // 3 s have no cycle of 0.1 Hz
  rising[7] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(frequency_response(rising, constant, 100));
}

TEST(Bandwidth, ShortDipIsNoBandwidth) {
  std::vector<FrequencyPoint> points;
  for (int i = 0; i < 40; ++i) points.push_back({std::exp2(i / 12.0), i < 24 ? 1.0 : 0.5, 0, 1});
  points[10].magnitude = 0.1;
  const auto band = bandwidth_of(points);
  ASSERT_TRUE(band && band->frequency);
  // Half way of the logarithms between points 23 and 24: 1 falls to 0.5.
  EXPECT_NEAR(*band->frequency, std::exp2(23.5 / 12), 1e-9);
  EXPECT_FALSE(bandwidth_of({}));
  for (FrequencyPoint& point : points) point.coherence = 0.1;
  EXPECT_FALSE(bandwidth_of(points));
}

}  // namespace
}  // namespace doppel
