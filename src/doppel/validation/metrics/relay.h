#pragma once
// Relay feedback identification (Astrom, Hagglund, Automatica 20, 1984): a relay in place of a controller
// makes a loop oscillate near its ultimate frequency; the amplitude of the oscillation gives the ultimate
// gain.

#include <optional>
#include <span>

#include "doppel/export.h"

namespace doppel {

struct RelayOptions {
  double amplitude = 0;   // d, unit of the effort (N m, N, rad/s): the relay switches between +d and -d
  double hysteresis = 0;  // eps, unit of the output: the relay switches at -eps and +eps
  double begin = 0;       // s: earlier samples are the transient
};

struct RelayFigures {
  // 4 d / (pi sqrt(a^2 - eps^2)), a: amplitude of the fundamental of the output. Without hysteresis it is
  // exact at the observed frequency, also where the oscillation is a triangle, for which half of the
  // peak-to-peak value is 23 % too large.
  double ultimate_gain = 0;
  double peak_gain = 0;        // the same with a: half of the peak-to-peak value, as in the textbooks
  double ultimate_period = 0;  // s: T_u, mean of the cycles
  double fundamental = 0;      // unit of the output
  double half_range = 0;       // unit of the output: half of the mean peak-to-peak value of the cycles
  int cycles = 0;              // whole ones after `begin`
  double period_spread = 0;    // of the period: (longest - shortest cycle) / mean; above 0.05 no limit cycle
};

// From samples of the output of the loop (the measured position or speed). A cycle begins where the output
// rises through the middle of its range. None with fewer than two cycles, an amplitude that is within the
// hysteresis, values that are not finite, times that do not rise, or a relay without amplitude.
DOPPEL_API std::optional<RelayFigures> relay_figures(std::span<const double> time,
                                                     std::span<const double> output,
                                                     const RelayOptions& options);

// Gains of the parallel form: effort = p e + i integral(e) + d de/dt.
struct RuleGains {
  double p = 0, i = 0, d = 0;
};

enum class TuningRule {
  ziegler_nichols,  // K = 0.6 K_u, T_i = T_u / 2, T_d = T_u / 8 (Ziegler, Nichols, Trans. ASME 64, 1942)
  tyreus_luyben,    // K = K_u / 2.2, T_i = 2.2 T_u, T_d = T_u / 6.3 (Luyben, Essentials of Process Control)
  no_overshoot,     // K = 0.2 K_u, T_i = T_u / 2, T_d = T_u / 3 (Seborg, Edgar, Mellichamp, 2004)
};
inline constexpr TuningRule kTuningRules[] = {TuningRule::ziegler_nichols, TuningRule::tyreus_luyben,
                                              TuningRule::no_overshoot};
DOPPEL_API const char* name_of(TuningRule rule);  // "Ziegler-Nichols"

// None unless both values are positive.
DOPPEL_API std::optional<RuleGains> gains_by_rule(TuningRule rule, double ultimate_gain,
                                                  double ultimate_period);

}  // namespace doppel
