#include "doppel/sensors/noise.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

// Channels of a sensor's random numbers: those of its values are below.
constexpr std::uint32_t kBias = 0x40000000u, kSign = 0x40010000u, kWalk = 0x40020000u;

}  // namespace

ChannelNoise::ChannelNoise(const NoiseDescription& noise, const CounterRandom& random, std::uint32_t channel,
                           double period)
    : noise_(noise), random_(random), channel_(channel) {
  bias_ = noise.bias_mean + noise.bias_stddev * random.normal(0, kBias + channel);
  if (random.uniform(0, kSign + channel) < 0.5) bias_ = -bias_;
  first_bias_ = bias_;
  if (noise.walk_stddev > 0 && noise.walk_time > 0 && period > 0) {
    decay_ = std::exp(-period / noise.walk_time);
    walk_ =
        noise.walk_stddev * std::sqrt(noise.walk_time / 2 * (1 - std::exp(-2 * period / noise.walk_time)));
  }
}

void ChannelNoise::advance(std::uint64_t sample) {
  if (walk_ <= 0) next_ = std::max(next_, sample + 1);
  for (; next_ <= sample; ++next_) bias_ = decay_ * bias_ + walk_ * random_.normal(next_, kWalk + channel_);
}

void ChannelNoise::resume(const ChannelNoise& before) {
  next_ = before.next_;
  if (first_bias_ == before.first_bias_ && decay_ == before.decay_ && walk_ == before.walk_)
    bias_ = before.bias_;
}

double ChannelNoise::apply(double value, std::uint64_t sample) const {
  double out = value + noise_.mean + bias_;
  if (noise_.stddev > 0) out += noise_.stddev * random_.normal(sample, channel_);
  return noise_.precision > 0 && std::isfinite(out) ? std::round(out / noise_.precision) * noise_.precision
                                                    : out;
}

void ChannelNoise::apply(std::span<float> values, std::uint64_t sample, std::vector<float>& scratch) const {
  if (!noise_.any()) return;
  const auto offset = static_cast<float>(noise_.mean + bias_), stddev = static_cast<float>(noise_.stddev);
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
