#include "doppel/sensors/models/noise.h"

#include <Eigen/Core>
#include <cmath>

namespace doppel {
namespace {

// Channels of a sensor's random numbers: those of its values are below.
constexpr std::uint32_t kBias = 0x40000000u, kSign = 0x40010000u, kWalk = 0x40020000u;

}  // namespace

ChannelNoise::ChannelNoise(const NoiseDescription& noise, const CounterRandom& random, std::uint32_t channel,
                           double period)
    : noise_(noise), random_(random), channel_(channel) {
  double first = noise.bias_mean + noise.bias_stddev * random.normal(0, kBias + channel);
  if (random.uniform(0, kSign + channel) < 0.5) first = -first;
  walk_ = BiasWalk(first, noise.walk_stddev, noise.walk_time, period, random, kWalk + channel);
}

double ChannelNoise::bias(std::uint64_t sample) {
  return walk_.at(sample < begin_ ? 0 : sample + 1 - begin_);
}

void ChannelNoise::resume(const ChannelNoise& before, std::uint64_t next) {
  begin_ = walk_.same_as(before.walk_) ? before.begin_ : next;
}

double ChannelNoise::apply(double value, std::uint64_t sample) {
  double out = value + noise_.mean + bias(sample);
  if (noise_.stddev > 0) out += noise_.stddev * random_.normal(sample, channel_);
  return noise_.precision > 0 && std::isfinite(out) ? std::round(out / noise_.precision) * noise_.precision
                                                    : out;
}

void ChannelNoise::apply(std::span<float> values, std::uint64_t sample, std::vector<float>& scratch) {
  if (!noise_.any()) return;
  const auto offset = static_cast<float>(noise_.mean + bias(sample)),
             stddev = static_cast<float>(noise_.stddev);
  const auto count = static_cast<Eigen::Index>(values.size());
  Eigen::Map<Eigen::ArrayXf> all(values.data(), count);
  if (noise_.stddev > 0) {
    scratch.resize(values.size());
    random_.normals(sample, channel_, scratch);
    all += offset + stddev * Eigen::Map<const Eigen::ArrayXf>(scratch.data(), count);
  } else {
    all += offset;
  }
  if (noise_.precision <= 0) return;
  for (float& value : values)
    if (std::isfinite(value))
      value = static_cast<float>(std::round(value / noise_.precision) * noise_.precision);
}

}  // namespace doppel
