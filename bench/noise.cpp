// The cost of a bias that walks: of one channel at one sample, and of an hour at 1 kHz that is made up at once.
#include "doppel/sensors/noise.h"

#include <chrono>
#include <cstdio>

namespace {

double seconds_of(auto work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

int main() {
  constexpr std::uint64_t kHour = 3'600'000;
  constexpr int kChannels = 9;  // of an IMU
  doppel::NoiseDescription walk;
  walk.walk_stddev = 0.02;
  walk.walk_time = 100;
  const doppel::ChannelNoise first(walk, doppel::CounterRandom(1, "imu"), 0, 1e-3);
  doppel::ChannelNoise each = first, at_once = first;
  const double sampled = seconds_of([&] {
    for (std::uint64_t sample = 0; sample < kHour; ++sample) each.advance(sample);
  });
  const double made_up = seconds_of([&] { at_once.advance(kHour - 1); });
  std::printf(
      "a sample of one channel: %.1f ns; an hour of %d channels at 1 kHz, made up at once: %.0f ms%s\n",
      1e9 * sampled / static_cast<double>(kHour), kChannels, 1e3 * kChannels * made_up,
      each.bias() == at_once.bias() ? "" : " (with another bias)");
  return each.bias() == at_once.bias() ? 0 : 1;
}
