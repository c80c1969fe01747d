// The cost of a bias that walks: of one channel at one sample, and of the first one after an hour at 1 kHz in which nothing was read.
#include "doppel/sensors/models/noise.h"

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
  doppel::NoiseDescription walk;
  walk.walk_stddev = 0.02;
  walk.walk_time = 100;
  const doppel::ChannelNoise first(walk, doppel::CounterRandom(1, "imu"), 0, 1e-3);
  doppel::ChannelNoise each = first, at_once = first;
  double last = 0, alone = 0;
  const double sampled = seconds_of([&] {
    for (std::uint64_t sample = 0; sample < kHour; ++sample) last = each.bias(sample);
  });
  const double late = seconds_of([&] { alone = at_once.bias(kHour - 1); });
  std::printf("a sample of one channel: %.1f ns; the first one after an hour at 1 kHz: %.1f us%s\n",
              1e9 * sampled / static_cast<double>(kHour), 1e6 * late, last == alone ? "" : " (another bias)");
  return last == alone ? 0 : 1;
}
