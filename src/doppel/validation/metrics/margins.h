#pragma once
// The margins of a feedback loop by its open-loop response L(j w) (Astrom, Murray, Feedback Systems, 10.3).

#include <complex>
#include <functional>
#include <optional>
#include <vector>

#include "doppel/export.h"

namespace doppel {

using LoopResponse = std::function<std::complex<double>(double w)>;  // w in rad/s

// The searched frequencies: points at equal ratios, between which crossings are refined. A resonance that is
// narrower than the distance of points may be missed.
struct MarginSearch {
  double low = 1e-2, high = 1e4;  // rad/s
  int points_per_decade = 200;
};

struct LoopMargins {
  std::vector<double> gain_crossovers;   // rad/s: |L| = 1, rising
  std::vector<double> phase_crossovers;  // rad/s: L is real and negative, rising
  // For a stable loop the factor above 1, for an unstable one the factor below 1, by which the gain reaches
  // the limit of stability. None: no phase crossover limits it.
  std::optional<double> gain_margin;
  std::optional<double> gain_margin_frequency;  // rad/s
  std::optional<double> lowest_gain;            // factor below 1 at which a stable loop becomes unstable
  std::optional<double> phase_margin;           // rad: pi + arg L at `crossover`, signed
  std::optional<double> crossover;              // rad/s: the gain crossover with the margin nearest to 0
  std::optional<double> delay_margin;    // s: shortest additional delay that makes a stable loop unstable
  double max_sensitivity = 0;            // max 1 / |1 + L|
  double max_sensitivity_frequency = 0;  // rad/s
  // Nyquist's criterion decides within the searched frequencies, for a loop whose L has no pole right of the
  // imaginary axis (integrators are permitted; `low` must be so small that they determine the phase there).
  bool stable = false;
};

// None if the search is impossible (0 < low < high, a point per decade), or L is not finite at a point.
DOPPEL_API std::optional<LoopMargins> loop_margins(const LoopResponse& loop, const MarginSearch& search = {});

}  // namespace doppel
