#pragma once
// Noise of one channel of a sensor, as Gazebo makes it: white noise, a constant bias, its slow walk, and rounding.
// Source: gz-sensors 8, GaussianNoiseModel.cc.

#include <cstdint>
#include <span>
#include <vector>

#include "doppel/export.h"
#include "doppel/sensors/counter_random.h"
#include "doppel/sensors/sensor_description.h"

namespace doppel {

class DOPPEL_API ChannelNoise {
 public:
  ChannelNoise() = default;
  // `period`: s between samples.
  ChannelNoise(const NoiseDescription& noise, const CounterRandom& random, std::uint32_t channel,
               double period);

  // The bias walks once a sample, also for samples that nobody has read: up to this one. Samples count from 0; an earlier
  // one changes nothing. The time is in proportion to the samples since the last call.
  void advance(std::uint64_t sample);
  // Continues in place of a former channel: the walk goes on from its last sample, with its bias if that is described the same.
  void resume(const ChannelNoise& before);
  // The value with the noise of this sample.
  [[nodiscard]] double apply(double value, std::uint64_t sample) const;
  // The same for all finite values of the channel at once, such as the ranges of a scan, by CounterRandom::normals().
  // `scratch` is kept by the caller, so that it is allocated once.
  void apply(std::span<float> values, std::uint64_t sample, std::vector<float>& scratch) const;
  [[nodiscard]] double bias() const { return bias_; }
  [[nodiscard]] bool any() const { return noise_.any(); }
  [[nodiscard]] double stddev() const { return noise_.stddev; }

 private:
  NoiseDescription noise_;
  CounterRandom random_;
  std::uint32_t channel_ = 0;
  double first_bias_ = 0, bias_ = 0, decay_ = 1, walk_ = 0;
  std::uint64_t next_ = 0;  // the sample for which the bias walks next
};

}  // namespace doppel
