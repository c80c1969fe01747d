#pragma once
// Random numbers that are a function of what they are for: the run's seed, the sensor's name, the sample's number and
// the channel. So a sample has the same noise whether or not earlier ones were made. Source: J. Salmon and others,
// "Parallel random numbers: as easy as 1, 2, 3", 2011: Philox 4x32 with 10 rounds.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API CounterRandom {
 public:
  CounterRandom() = default;
  CounterRandom(std::uint64_t seed, std::string_view sensor);

  // Four independent words of 32 bits.
  [[nodiscard]] std::array<std::uint32_t, 4> words(std::uint64_t sample, std::uint32_t channel,
                                                   std::uint32_t index) const;
  // Uniform in [0, 1).
  [[nodiscard]] double uniform(std::uint64_t sample, std::uint32_t channel, std::uint32_t index = 0) const;
  // Normal, of mean 0 and standard deviation 1, by Box and Muller's method.
  [[nodiscard]] double normal(std::uint64_t sample, std::uint32_t channel, std::uint32_t index = 0) const;
  // Many at once, of 16 bits each: of 65,536 values, within 4.3 standard deviations.
  void normals(std::uint64_t sample, std::uint32_t channel, std::span<float> out) const;

 private:
  std::uint32_t key_[2] = {0, 0};
};

}  // namespace doppel
