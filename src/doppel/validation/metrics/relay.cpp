#include "doppel/validation/metrics/relay.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "doppel/validation/metrics/detail/samples.h"

namespace doppel {
namespace {

// The instants at which the output rises through a level, after it has been below a lower one: noise at the
// level begins no cycle.
std::vector<double> rises(std::span<const double> time, std::span<const double> output, double level,
                          double lower) {
  std::vector<double> out;
  bool armed = false;
  for (std::size_t i = 0; i + 1 < time.size(); ++i) {
    armed = armed || output[i] < lower;
    if (!armed || output[i] >= level || output[i + 1] < level) continue;
    out.push_back(std::lerp(time[i], time[i + 1], (level - output[i]) / (output[i + 1] - output[i])));
    armed = false;
  }
  return out;
}

// The amplitude of the frequency 1 / period between two instants, by the trapezoidal rule.
double fundamental_of(std::span<const double> time, std::span<const double> output, double begin, double end,
                      double period) {
  const double w = 2 * std::numbers::pi / period;
  const auto term = [&](double t) { return value_at(time, output, t) * std::polar(1.0, -w * (t - begin)); };
  std::complex<double> sum = 0, last = term(begin);
  double last_time = begin;
  const auto add = [&](double t) {
    const std::complex<double> next = term(t);
    sum += 0.5 * (t - last_time) * (last + next);
    last = next;
    last_time = t;
  };
  for (const double t : time)
    if (t > begin && t < end) add(t);
  add(end);
  return 2 * std::abs(sum) / (end - begin);
}

double mean_half_range(std::span<const double> time, std::span<const double> output,
                       const std::vector<double>& begins) {
  double sum = 0;
  for (std::size_t cycle = 0; cycle + 1 < begins.size(); ++cycle) {
    const auto first = std::ranges::lower_bound(time, begins[cycle]) - time.begin();
    const auto end = std::ranges::lower_bound(time, begins[cycle + 1]) - time.begin();
    const auto [low, high] = std::ranges::minmax(output.subspan(
        static_cast<std::size_t>(first), static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, end - first))));
    sum += 0.5 * (high - low);
  }
  return sum / static_cast<double>(begins.size() - 1);
}

}  // namespace

std::optional<RelayFigures> relay_figures(std::span<const double> time, std::span<const double> output,
                                          const RelayOptions& options) {
  if (!(options.amplitude > 0) || !std::isfinite(options.amplitude) || !(options.hysteresis >= 0) ||
      !std::isfinite(options.begin) || !is_sampled_signal(time, output, 4))
    return std::nullopt;
  const auto first = static_cast<std::size_t>(std::ranges::lower_bound(time, options.begin) - time.begin());
  if (first >= time.size()) return std::nullopt;
  time = time.subspan(first);
  output = output.subspan(first);
  const auto [low, high] = std::ranges::minmax(output);
  const std::vector<double> begins = rises(time, output, 0.5 * (low + high), 0.75 * low + 0.25 * high);
  if (begins.size() < 3) return std::nullopt;

  RelayFigures out;
  out.cycles = static_cast<int>(begins.size()) - 1;
  out.ultimate_period = (begins.back() - begins.front()) / out.cycles;
  double longest = 0, shortest = begins[1] - begins[0];
  for (std::size_t i = 1; i < begins.size(); ++i) {
    longest = std::max(longest, begins[i] - begins[i - 1]);
    shortest = std::min(shortest, begins[i] - begins[i - 1]);
  }
  out.period_spread = (longest - shortest) / out.ultimate_period;
  out.fundamental = fundamental_of(time, output, begins.front(), begins.back(), out.ultimate_period);
  out.half_range = mean_half_range(time, output, begins);
  if (!(std::min(out.fundamental, out.half_range) > options.hysteresis)) return std::nullopt;
  const auto gain = [&](double a) {
    const double eps = options.hysteresis;
    return 4 * options.amplitude / (std::numbers::pi * std::sqrt(a * a - eps * eps));
  };
  out.ultimate_gain = gain(out.fundamental);
  out.peak_gain = gain(out.half_range);
  return out;
}

const char* name_of(TuningRule rule) {
  switch (rule) {
    case TuningRule::ziegler_nichols:
      return "Ziegler-Nichols";
    case TuningRule::tyreus_luyben:
      return "Tyreus-Luyben";
    case TuningRule::no_overshoot:
      return "no overshoot";
  }
  return "";
}

std::optional<RuleGains> gains_by_rule(TuningRule rule, double ultimate_gain, double ultimate_period) {
  if (!(ultimate_gain > 0) || !(ultimate_period > 0)) return std::nullopt;
  double p = 0.6 * ultimate_gain, integral_time = 0.5 * ultimate_period, lead_time = ultimate_period / 8;
  if (rule == TuningRule::tyreus_luyben) {
    p = ultimate_gain / 2.2;
    integral_time = 2.2 * ultimate_period;
    lead_time = ultimate_period / 6.3;
  } else if (rule == TuningRule::no_overshoot) {
    p = 0.2 * ultimate_gain;
    lead_time = ultimate_period / 3;
  }
  return RuleGains{p, p / integral_time, p * lead_time};
}

}  // namespace doppel
