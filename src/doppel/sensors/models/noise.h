#pragma once
// Noise of one channel of a sensor, as Gazebo makes it: white noise, a constant bias, its slow walk, and rounding.
// Source: gz-sensors 8, GaussianNoiseModel.cc.

#include <cstdint>
#include <span>
#include <vector>

#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/export.h"
#include "doppel/sensors/models/bias_walk.h"
#include "doppel/sensors/models/counter_random.h"

namespace doppel {

class DOPPEL_API ChannelNoise {
 public:
  ChannelNoise() = default;
  // `period`: s between samples.
  ChannelNoise(const NoiseDescription& noise, const CounterRandom& random, std::uint32_t channel,
               double period);

  // Continues in place of a former channel from sample `next` on: a walk that is described the same goes on, another one
  // begins there.
  void resume(const ChannelNoise& before, std::uint64_t next);
  // Samples count from 0 again: the walk begins there.
  void restart() { begin_ = 0; }
  // The sample with the first step of the walk, which is all that changes while it is used.
  [[nodiscard]] std::uint64_t begin() const { return begin_; }
  void set_begin(std::uint64_t begin) { begin_ = begin; }
  // The value with the noise of this sample, which is a function of its number alone. Samples count from 0.
  [[nodiscard]] double apply(double value, std::uint64_t sample);
  // The same for all finite values of the channel at once, such as the ranges of a scan, by CounterRandom::normals().
  // `scratch` is kept by the caller, so that it is allocated once.
  void apply(std::span<float> values, std::uint64_t sample, std::vector<float>& scratch);
  // Walks once a sample, whether or not it is read (bias_walk.h).
  [[nodiscard]] double bias(std::uint64_t sample);
  [[nodiscard]] bool any() const { return noise_.any(); }
  [[nodiscard]] double stddev() const { return noise_.stddev; }

 private:
  NoiseDescription noise_;
  CounterRandom random_;
  std::uint32_t channel_ = 0;
  BiasWalk walk_;
  std::uint64_t begin_ = 0;  // the sample with the first step of the walk
};

}  // namespace doppel
