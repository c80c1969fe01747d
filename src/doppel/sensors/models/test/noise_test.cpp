#include "doppel/sensors/models/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "doppel/sensors/models/image_noise.h"

namespace doppel {
namespace {

constexpr int kSamples = 1'000'000;

struct Moments {
  double mean = 0, stddev = 0;
};
template <typename Value>
Moments moments(int count, Value value) {
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const double x = value(i);
    sum += x;
    squares += x * x;
  }
  const double mean = sum / count;
  return {mean, std::sqrt(squares / count - mean * mean)};
}

TEST(CounterRandom, WordsAreThoseOfPublishedVectors) {
  // Philox 4x32-10 of key 0 and counter 0, from Random123's kat_vectors; the key is that of no seed, so by itself.
  EXPECT_EQ(CounterRandom().words(0, 0, 0),
            (std::array<std::uint32_t, 4>{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
}

TEST(CounterRandom, SensorsSeedsSamplesAndChannelsDiffer) {
  std::set<double> seen;
  for (const std::uint64_t seed : {1, 2})
    for (const char* sensor : {"a", "b"})
      for (std::uint64_t sample = 0; sample < 5; ++sample)
        for (std::uint32_t channel = 0; channel < 5; ++channel)
          seen.insert(CounterRandom(seed, sensor).uniform(sample, channel));
  EXPECT_EQ(seen.size(), 100U);
}

TEST(SensorNoise, MeanAndDeviationAreThoseAskedFor) {
  NoiseDescription noise;
  noise.mean = 0.3;
  noise.stddev = 0.05;
  ChannelNoise channel(noise, CounterRandom(7, "imu"), 2, 0.01);
  const Moments m = moments(kSamples, [&](int i) { return channel.apply(1, static_cast<std::uint64_t>(i)); });
  EXPECT_NEAR(m.mean, 1.3, 0.01 * 0.3);
  EXPECT_NEAR(m.stddev, 0.05, 0.01 * 0.05);
}

TEST(SensorNoise, ValuesOfOneSampleHaveMeanAndDeviationAskedForOnTheirGrid) {
  NoiseDescription noise;
  noise.mean = 0.3;
  noise.stddev = 0.05;
  noise.precision = 0.001;
  ChannelNoise channel(noise, CounterRandom(7, "lidar"), 0, 0.1);
  std::vector<float> values(kSamples, 1), again(kSamples, 1), next(kSamples, 1), scratch;
  values[3] = again[3] = std::numeric_limits<float>::infinity();
  channel.apply(values, 5, scratch);
  channel.apply(again, 5, scratch);
  channel.apply(next, 6, scratch);
  EXPECT_EQ(values, again);
  EXPECT_NE(values, next);
  EXPECT_EQ(values[3], std::numeric_limits<float>::infinity());
  values[3] = 1.3F;
  const Moments m = moments(kSamples, [&](int i) { return values[static_cast<std::size_t>(i)]; });
  EXPECT_NEAR(m.mean, 1.3, 0.01 * 0.3);
  EXPECT_NEAR(m.stddev, 0.05, 0.01 * 0.05);
  for (std::size_t i = 0; i < 1000; ++i) EXPECT_NEAR(values[i] / 0.001, std::round(values[i] / 0.001), 1e-3);
}

TEST(SensorNoise, NormalsOfManyAreNormal) {
  std::vector<float> values(kSamples);
  CounterRandom(3, "camera").normals(9, 0, values);
  const Moments m = moments(kSamples, [&](int i) { return values[static_cast<std::size_t>(i)]; });
  EXPECT_NEAR(m.mean, 0, 0.004);
  EXPECT_NEAR(m.stddev, 1, 0.01);
  int within = 0;
  for (const float value : values) within += std::abs(value) < 1 ? 1 : 0;
  EXPECT_NEAR(within / static_cast<double>(kSamples), 0.682689, 0.003);
}

TEST(SensorNoise, WalkOfBiasHasVarianceOfItsFormula) {
  NoiseDescription noise;
  noise.walk_stddev = 0.02;
  noise.walk_time = 0.5;
  ChannelNoise channel(noise, CounterRandom(11, "gyro"), 0, 0.01);
  const Moments m = moments(kSamples, [&](int i) { return channel.bias(static_cast<std::uint64_t>(i)); });
  // Stationary: sigma^2 tau / 2. A million samples are 10,000 s, that is 20,000 correlation times.
  EXPECT_NEAR(m.stddev, 0.02 * std::sqrt(0.5 / 2), 0.03 * 0.01);
}

TEST(SensorNoise, BiasHasItsMeanAndBothSigns) {
  NoiseDescription noise;
  noise.bias_mean = 1;
  noise.bias_stddev = 0.1;
  int negative = 0;
  const Moments m = moments(2000, [&](int i) {
    const double bias =
        ChannelNoise(noise, CounterRandom(static_cast<std::uint64_t>(i), "imu"), 0, 0.01).bias(0);
    negative += bias < 0 ? 1 : 0;
    return std::abs(bias);
  });
  EXPECT_NEAR(m.mean, 1, 0.01);
  EXPECT_NEAR(m.stddev, 0.1, 0.01);
  EXPECT_NEAR(negative, 1000, 100);
}

TEST(SensorNoise, QuantisedValuesAreOnTheirGrid) {
  NoiseDescription noise;
  noise.stddev = 0.1;
  noise.precision = 0.025;
  ChannelNoise channel(noise, CounterRandom(7, "imu"), 0, 0.01);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const double steps = channel.apply(0.3, i) / 0.025;
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
  }
}

TEST(ImageNoise, IsFunctionOfSampleAndPixelOnly) {
  NoiseDescription noise;
  noise.stddev = 0.02;
  std::vector<float> scratch;
  const auto picture = [&](std::uint64_t seed, std::uint64_t sample) {
    std::vector<std::uint8_t> values(30000, 128);
    add_colour_noise(noise, CounterRandom(seed, "camera"), sample, values, scratch);
    return values;
  };
  EXPECT_EQ(picture(1, 5), picture(1, 5));
  EXPECT_NE(picture(1, 5), picture(1, 6));
  EXPECT_NE(picture(1, 5), picture(2, 5));
  const auto values = picture(1, 5);
  const Moments m = moments(30000, [&](int i) { return values[static_cast<std::size_t>(i)]; });
  EXPECT_NEAR(m.mean, 128, 0.1);
  EXPECT_NEAR(m.stddev, std::sqrt(5.1 * 5.1 + 1.0 / 12), 0.1);
}

TEST(DepthNoise, GrowsWithDistanceAndDropsItsPart) {
  CameraDescription camera;
  camera.width = 1000;
  camera.depth_noise = {0.001, 0, 0.002};
  camera.dropout = 0.1;
  std::vector<float> scratch;
  for (const float z : {1.0F, 3.0F}) {
    std::vector<float> depths(200000, z);
    add_depth_noise(camera, CounterRandom(1, "depth"), 0, depths, scratch);
    double sum = 0, squares = 0;
    int left = 0;
    for (const float depth : depths) {
      if (std::isnan(depth)) continue;
      ++left;
      sum += depth - z;
      squares += (depth - z) * (depth - z);
    }
    EXPECT_NEAR(left / 200000.0, 0.9, 0.005);
    EXPECT_NEAR(sum / left, 0, 1e-4 * z);
    EXPECT_NEAR(std::sqrt(squares / left), 0.001 + 0.002 * z * z, 0.02 * (0.001 + 0.002 * z * z));
  }
}

}  // namespace
}  // namespace doppel
