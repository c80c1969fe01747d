#include "doppel/validation/metrics/stopping.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "doppel/validation/metrics/detail/samples.h"

namespace doppel {
namespace {

// Samples from the trigger on; the first is the trigger, at 0 s and position 0.
struct StopSamples {
  std::vector<double> time, way, speed;
};

StopSamples samples_of_stop(std::span<const double> time, std::span<const double> position,
                            std::span<const double> speed, double trigger) {
  const double start = value_at(time, position, trigger);
  StopSamples out{{0.0}, {0.0}, {value_at(time, speed, trigger)}};
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (time[i] <= trigger) continue;
    out.time.push_back(time[i] - trigger);
    out.way.push_back(position[i] - start);
    out.speed.push_back(speed[i]);
  }
  return out;
}

// Seconds after sample i until the speed falls to the threshold; sample i + 1 is below it.
double time_to_rest(const StopSamples& samples, std::size_t i, double threshold) {
  const double span = samples.time[i + 1] - samples.time[i];
  const double sign = samples.speed[i] < 0 ? -1 : 1;
  const double v = sign * samples.speed[i];
  double out = span * (v - threshold) / (v - sign * samples.speed[i + 1]);
  if (i == 0) return out;
  const double slope = (sign * samples.speed[i - 1] - v) / (samples.time[i] - samples.time[i - 1]);
  if (slope > 0) out = std::min(out, (v - threshold) / slope);
  return out;
}

}  // namespace

std::optional<StopFigures> stop_figures(std::span<const double> time, std::span<const double> position,
                                        std::span<const double> speed, const StopOptions& options) {
  if (!std::isfinite(options.stop_time) || !(options.threshold > 0) ||
      !is_sampled_signal(time, position, 2) || !is_sampled_signal(time, speed, 2) ||
      options.stop_time >= time.back())
    return std::nullopt;
  const StopSamples samples = samples_of_stop(time, position, speed, options.stop_time);
  StopFigures out;
  out.initial_speed = samples.speed.front();
  for (const double way : samples.way) out.largest_way = std::max(out.largest_way, std::abs(way));
  std::size_t rest = samples.time.size();  // first sample of those that remain below the threshold
  while (rest > 0 && std::abs(samples.speed[rest - 1]) < options.threshold) --rest;
  out.stopped = rest < samples.time.size();
  if (!out.stopped) {
    out.time = samples.time.back();
    out.distance = std::abs(samples.way.back());
  } else if (rest > 0) {
    const std::size_t i = rest - 1;
    const double span = time_to_rest(samples, i, options.threshold);
    const double end_speed = std::copysign(options.threshold, samples.speed[i]);
    out.time = samples.time[i] + span;
    out.distance = std::abs(samples.way[i] + 0.5 * (samples.speed[i] + end_speed) * span);
    out.largest_way = std::max(out.largest_way, out.distance);
  }
  return out;
}

}  // namespace doppel
