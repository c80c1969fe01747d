#include "doppel/sensors/models/bias_walk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace doppel {
namespace {

constexpr double kStddev = 0.02, kTime = 0.5, kPeriod = 0.01, kFirst = 0.3;

BiasWalk walk(std::uint64_t seed, double time = kTime) {
  return {kFirst, kStddev, time, kPeriod, CounterRandom(seed, "gyro"), 7};
}

TEST(BiasWalk, ValueIsSameWhateverWasAskedForBefore) {
  BiasWalk in_order = walk(3), backwards = walk(3);
  std::vector<double> values;
  for (std::uint64_t n = 0; n < 3000; ++n) values.push_back(in_order.at(n));
  EXPECT_EQ(values[0], kFirst);
  for (std::uint64_t n = 3000; n-- > 0;) ASSERT_EQ(backwards.at(n), values[n]) << n;
  for (const std::uint64_t n : {1U, 2U, 777U, 1024U, 1025U, 2999U}) {
    BiasWalk alone = walk(3), jumping = walk(3);
    EXPECT_EQ(alone.at(n), values[n]);
    jumping.at(1'000'000);
    jumping.at(n / 2);
    EXPECT_EQ(jumping.at(n), values[n]);
  }
}

TEST(BiasWalk, AnyValueNeedsFewRandomNumbersAndNextOneNeedsOne) {
  BiasWalk walking = walk(3);
  walking.at(std::uint64_t{1} << 40 | 12345);
  EXPECT_LE(walking.draws(), 2U * 41);
  BiasWalk in_order = walk(3);
  for (std::uint64_t n = 0; n <= 4096; ++n) in_order.at(n);
  EXPECT_EQ(in_order.draws(), 4096U);
}

// Of many walks: mean first e^(-t/T), variance s^2 (1 - e^(-2 t/T)), covariance of two instants s^2 (e^(-d/T) - e^(-(t+u)/T)).
TEST(BiasWalk, MomentsAreThoseOfOrnsteinUhlenbeckProcess) {
  constexpr int kWalks = 40000;
  const std::vector<std::uint64_t> at{1, 3, 8, 13, 64, 100};
  std::vector<double> mean(at.size());
  std::vector<std::vector<double>> product(at.size(), std::vector<double>(at.size()));
  for (int i = 0; i < kWalks; ++i) {
    BiasWalk one = walk(static_cast<std::uint64_t>(i));
    std::vector<double> values;
    for (const std::uint64_t n : at) values.push_back(one.at(n));
    for (std::size_t a = 0; a < at.size(); ++a) {
      mean[a] += values[a] / kWalks;
      for (std::size_t b = 0; b < at.size(); ++b) product[a][b] += values[a] * values[b] / kWalks;
    }
  }
  const double variance = kStddev * kStddev * kTime / 2;
  const auto decayed = [&](double steps) { return std::exp(-steps * kPeriod / kTime); };
  for (std::size_t a = 0; a < at.size(); ++a) {
    EXPECT_NEAR(mean[a], kFirst * decayed(static_cast<double>(at[a])), 4 * std::sqrt(variance / kWalks))
        << at[a];
    for (std::size_t b = a; b < at.size(); ++b) {
      const auto t = static_cast<double>(at[a]), u = static_cast<double>(at[b]);
      EXPECT_NEAR(product[a][b] - mean[a] * mean[b], variance * (decayed(u - t) - decayed(u + t)),
                  0.03 * variance)
          << at[a] << " and " << at[b];
    }
  }
}

TEST(BiasWalk, IncrementsOfLongCorrelationAreThoseOfRandomWalk) {
  constexpr int kSteps = 100000;
  BiasWalk one = walk(5, 1e9);
  double squares = 0, last = one.at(0);
  for (std::uint64_t n = 1; n <= kSteps; ++n) {
    const double next = one.at(n);
    squares += (next - last) * (next - last);
    last = next;
  }
  EXPECT_NEAR(std::sqrt(squares / kSteps), kStddev * std::sqrt(kPeriod), 0.01 * kStddev * std::sqrt(kPeriod));
}

TEST(BiasWalk, ValueStaysWithoutDeviationOrTime) {
  for (const auto& [stddev, time, period] : {std::array{0.0, 1.0, 1.0}, {1.0, 0.0, 1.0}, {1.0, 1.0, 0.0}}) {
    BiasWalk still(kFirst, stddev, time, period, CounterRandom(1, "gyro"), 0);
    EXPECT_EQ(still.at(1'000'000), kFirst);
    EXPECT_EQ(still.draws(), 0U);
  }
}

}  // namespace
}  // namespace doppel
