#include "doppel/validation/metrics/margins.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace doppel {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kHalvings = 60;
constexpr double kGoldenRatio = 0.6180339887498949;  // 1 / phi

struct LoopPoint {
  double w = 0;
  std::complex<double> value;
  double phase = 0;  // rad, continuous from the first point
};

std::optional<std::vector<LoopPoint>> sampled_loop(const LoopResponse& loop, const MarginSearch& search) {
  if (!loop || !(search.low > 0) || !(search.high > search.low) || !std::isfinite(search.high) ||
      search.points_per_decade < 1)
    return std::nullopt;
  const double decades = std::log10(search.high / search.low);
  const int count = static_cast<int>(std::ceil(decades * search.points_per_decade)) + 1;
  std::vector<LoopPoint> out;
  for (int i = 0; i < count; ++i) {
    LoopPoint point;
    point.w = search.low * std::pow(10.0, decades * i / std::max(1, count - 1));
    point.value = loop(point.w);
    if (!std::isfinite(point.value.real()) || !std::isfinite(point.value.imag())) return std::nullopt;
    point.phase = std::arg(point.value);
    if (!out.empty())
      point.phase = out.back().phase + std::remainder(point.phase - out.back().phase, 2 * kPi);
    else if (point.phase > kPi / 4 && std::abs(point.value) > 1)
      point.phase -= 2 * kPi;  // three integrators, not a lead
    out.push_back(point);
  }
  return out;
}

// The frequency between two points at which a function, which differs in sign there, is 0.
double root_between(double low, double high, const std::function<double(double)>& function) {
  const bool rises = function(low) < function(high);
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    ((function(middle) < 0) == rises ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

// The number of the negative real axes (-pi, -3 pi, ...) that a continuous phase has passed downwards.
int axes_passed(double phase) {
  return static_cast<int>(std::floor((kPi - phase) / (2 * kPi)));
}

void find_crossovers(const LoopResponse& loop, const std::vector<LoopPoint>& points, LoopMargins& out) {
  // Encirclements of -1 by the half plane's contour, whose small arc around 0 integrators pass with an
  // infinite gain, from the phase 0 to that of the first point.
  int passed = std::abs(points.front().value) > 1 ? axes_passed(points.front().phase) : 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const LoopPoint &a = points[i - 1], &b = points[i];
    if ((std::abs(a.value) < 1) != (std::abs(b.value) < 1))
      out.gain_crossovers.push_back(
          root_between(a.w, b.w, [&](double w) { return std::abs(loop(w)) < 1 ? -1.0 : 1.0; }));
    const int axes = axes_passed(b.phase) - axes_passed(a.phase);
    if (axes == 0) continue;
    const double w = root_between(a.w, b.w, [&](double v) { return std::arg(-loop(v)); });
    out.phase_crossovers.push_back(w);
    if (std::abs(loop(w)) > 1) passed += axes;
  }
  out.stable = passed == 0;
}

void find_gain_margin(const LoopResponse& loop, LoopMargins& out) {
  for (const double w : out.phase_crossovers) {
    const double factor = 1 / std::abs(loop(w));
    if (out.stable == (factor > 1)) {
      const bool nearer =
          !out.gain_margin || std::abs(std::log(factor)) < std::abs(std::log(*out.gain_margin));
      if (!nearer) continue;
      out.gain_margin = factor;
      out.gain_margin_frequency = w;
    } else if (out.stable) {
      out.lowest_gain = std::max(out.lowest_gain.value_or(0), factor);
    }
  }
}

void find_phase_margin(const LoopResponse& loop, LoopMargins& out) {
  for (const double w : out.gain_crossovers) {
    const double margin = std::arg(-loop(w));
    if (!out.phase_margin || std::abs(margin) < std::abs(*out.phase_margin)) {
      out.phase_margin = margin;
      out.crossover = w;
    }
    // A delay turns L clockwise until it reaches the negative real axis.
    const double delay = (margin >= 0 ? margin : margin + 2 * kPi) / w;
    if (out.stable) out.delay_margin = std::min(out.delay_margin.value_or(delay), delay);
  }
}

void find_sensitivity(const LoopResponse& loop, const std::vector<LoopPoint>& points, LoopMargins& out) {
  const auto distance = [&](double w) { return std::abs(1.0 + loop(w)); };
  const auto nearest = std::ranges::min_element(
      points, {}, [](const LoopPoint& point) { return std::abs(1.0 + point.value); });
  double low = (nearest == points.begin() ? nearest : nearest - 1)->w;
  double high = (nearest + 1 == points.end() ? nearest : nearest + 1)->w;
  for (int i = 0; i < kHalvings; ++i) {  // golden section
    const double a = high - kGoldenRatio * (high - low), b = low + kGoldenRatio * (high - low);
    (distance(a) < distance(b) ? high : low) = distance(a) < distance(b) ? b : a;
  }
  out.max_sensitivity_frequency = 0.5 * (low + high);
  const double least = std::min(distance(out.max_sensitivity_frequency), std::abs(1.0 + nearest->value));
  out.max_sensitivity = least > 0 ? 1 / least : std::numeric_limits<double>::infinity();
}

}  // namespace

std::optional<LoopMargins> loop_margins(const LoopResponse& loop, const MarginSearch& search) {
  const auto points = sampled_loop(loop, search);
  if (!points) return std::nullopt;
  LoopMargins out;
  find_crossovers(loop, *points, out);
  find_gain_margin(loop, out);
  find_phase_margin(loop, out);
  find_sensitivity(loop, *points, out);
  return out;
}

}  // namespace doppel
