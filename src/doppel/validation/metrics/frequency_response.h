#pragma once
// The frequency response of a joint: its excitation by a sine sweep, the estimate H = S_uy / S_uu from
// samples of input and output (Welch, IEEE Trans. Audio Electroacoustics 15, 1967; Bendat, Piersol, Random
// Data, 6.1), and the bandwidth.

#include <optional>
#include <span>
#include <vector>

#include "doppel/export.h"

namespace doppel {

// A sine whose frequency rises by a constant factor per second, from `low` to `high`. It begins and ends at
// 0, after a whole number of cycles, so that its command has no jump.
struct DOPPEL_API SineSweep {
  double low = 0.1, high = 20;  // Hz
  double duration = 30;         // s: of the rise to `high`; end() is less than one cycle later
  double amplitude = 0.05;      // rad or m

  [[nodiscard]] bool valid() const;                   // 0 < low < high, all values finite and positive
  [[nodiscard]] double end() const;                   // s
  [[nodiscard]] double position_at(double t) const;   // rad or m; 0 before 0 and after end()
  [[nodiscard]] double frequency_at(double t) const;  // Hz
  [[nodiscard]] double max_speed() const;  // rad/s or m/s: a drive that is slower is no linear system
};

struct ResponseOptions {
  double low = 0.1, high = 20;  // Hz
  int points = 200;             // at equal ratios of frequencies from `low` to `high`
  // s: length of segments with a Hann window and 50 % overlap. 0: the whole record is one segment without a
  // window. That is exact for a linear system which rests at the first and the last sample, as after a
  // sweep and some seconds of rest. Segments are for other records: with a sweep and 20 s their error is
  // 0.5 % for joints of 5 Hz, 7 % for joints of 0.5 Hz, because the window changes while a slow joint
  // answers.
  double segment = 0;
};

struct FrequencyPoint {
  double frequency = 0;  // Hz
  double magnitude = 0;  // output / input
  double phase = 0;      // rad: continuous from the first point, whose phase is in (-pi, pi]
  double coherence = 0;  // 0 to 1; 1 where the estimate has one segment and one line of the spectrum
};

// The signals are equidistant at `rate` Hz, and at rest at the first sample, whose value is subtracted.
// Spectra are averaged over segments and between neighbouring points. None if a value is not finite, the
// input is constant, the numbers of samples are unequal or too small for a cycle of `low`, or `high` is
// above half the rate.
DOPPEL_API std::optional<std::vector<FrequencyPoint>> frequency_response(std::span<const double> input,
                                                                         std::span<const double> output,
                                                                         double rate,
                                                                         const ResponseOptions& options = {});

struct BandwidthOptions {
  double reference = 1;        // gain at 0 Hz: 1 for a position that follows its command
  double min_coherence = 0.5;  // points with a smaller one are left out
};

struct Bandwidth {
  // Hz: the magnitude falls to reference / sqrt(2) (-3.01 dB) and remains below it for a sixth of an
  // octave, or until the last point. None: it does not fall so far, or is below from the first point on.
  std::optional<double> frequency;
  double phase = 0;           // rad, at `frequency`
  double peak_magnitude = 0;  // output / input
  double peak_frequency = 0;  // Hz; the lowest one of a response without a resonance
};

// Logarithmic interpolation between points. None without two points of sufficient coherence.
DOPPEL_API std::optional<Bandwidth> bandwidth_of(std::span<const FrequencyPoint> response,
                                                 const BandwidthOptions& options = {});

}  // namespace doppel
