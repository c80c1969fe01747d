#include "doppel/validation/metrics/detail/samples.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace doppel {

bool all_finite(std::span<const double> values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

bool is_sampled_signal(std::span<const double> time, std::span<const double> values, std::size_t count) {
  return time.size() == values.size() && time.size() >= count && all_finite(time) && all_finite(values) &&
         std::ranges::adjacent_find(time, std::greater_equal{}) == time.end();
}

double value_at(std::span<const double> time, std::span<const double> values, double instant) {
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(time, instant) - time.begin());
  if (next == 0) return values.front();
  if (next == time.size()) return values.back();
  const double way = (instant - time[next - 1]) / (time[next] - time[next - 1]);
  return std::lerp(values[next - 1], values[next], way);
}

double mean_of(std::span<const double> values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double deviation_of(std::span<const double> values) {
  if (values.size() < 2) return 0;
  const double mean = mean_of(values);
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

}  // namespace doppel
