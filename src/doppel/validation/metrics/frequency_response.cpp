#include "doppel/validation/metrics/frequency_response.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "doppel/validation/metrics/detail/samples.h"

namespace doppel {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

double growth(const SineSweep& sweep) {
  return std::log(sweep.high / sweep.low) / sweep.duration;
}

double cycles_until(const SineSweep& sweep, double t) {
  return sweep.low / growth(sweep) * std::expm1(growth(sweep) * t);
}

// Sums over segments, by the lines of the spectrum.
struct Spectra {
  double spacing = 0;  // Hz between lines
  std::vector<std::complex<double>> uy;
  std::vector<double> uu, yy;
};

// Segments with a Hann window begin half a segment before the record, so that its ends have the weight of
// its middle.
struct Segments {
  std::ptrdiff_t length = 0, hop = 0, first = 0;
  bool windowed = false;
};

Segments segments_of(std::size_t samples, double rate, double segment) {
  const auto count = static_cast<std::ptrdiff_t>(samples);
  if (segment <= 0) return {count, count, 0, false};
  const auto half = std::max<std::ptrdiff_t>(1, std::llround(0.5 * segment * rate));
  return {2 * half, half, -half, true};
}

std::vector<std::complex<double>> spectrum_of(std::span<const double> signal, std::ptrdiff_t begin,
                                              const Segments& segments, std::size_t lines,
                                              Eigen::FFT<double>& transform) {
  std::vector<double> part(lines, 0.0);
  for (std::ptrdiff_t i = 0; i < segments.length; ++i) {
    const std::ptrdiff_t sample = begin + i;
    if (sample < 0 || sample >= std::ssize(signal)) continue;
    const double phase = kTurn * static_cast<double>(i) / static_cast<double>(segments.length);
    const double weight = segments.windowed ? 0.5 - 0.5 * std::cos(phase) : 1;
    part[static_cast<std::size_t>(i)] = weight * (signal[static_cast<std::size_t>(sample)] - signal.front());
  }
  std::vector<std::complex<double>> out;
  transform.fwd(out, part);
  return out;
}

Spectra spectra_of(std::span<const double> input, std::span<const double> output, double rate,
                   const Segments& segments) {
  // Zeros after the segment give at least four lines for each independent one.
  const std::size_t lines = std::bit_ceil(4 * static_cast<std::size_t>(segments.length));
  Spectra out{rate / static_cast<double>(lines), {}, {}, {}};
  out.uy.resize(lines / 2);
  out.uu.resize(lines / 2);
  out.yy.resize(lines / 2);
  Eigen::FFT<double> transform;
  transform.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  for (std::ptrdiff_t begin = segments.first; begin < std::ssize(input); begin += segments.hop) {
    const auto u = spectrum_of(input, begin, segments, lines, transform);
    const auto y = spectrum_of(output, begin, segments, lines, transform);
    for (std::size_t k = 0; k < lines / 2; ++k) {
      out.uy[k] += std::conj(u[k]) * y[k];
      out.uu[k] += std::norm(u[k]);
      out.yy[k] += std::norm(y[k]);
    }
  }
  return out;
}

// The mean of the spectra around a frequency, with weights that fall linearly to 0 at a distance of
// `width`, or of one line if this is more: a linear interpolation between two lines.
FrequencyPoint point_of(const Spectra& spectra, double frequency, double width) {
  const double centre = frequency / spectra.spacing, reach = std::max(1.0, width / spectra.spacing);
  const auto first = static_cast<std::size_t>(std::ceil(std::max(0.0, centre - reach)));
  const auto end = std::min(spectra.uy.size(), static_cast<std::size_t>(std::floor(centre + reach)) + 1);
  std::complex<double> uy = 0;
  double uu = 0, yy = 0;
  for (std::size_t line = first; line < end; ++line) {
    const double weight = std::max(0.0, 1 - std::abs(static_cast<double>(line) - centre) / reach);
    uy += weight * spectra.uy[line];
    uu += weight * spectra.uu[line];
    yy += weight * spectra.yy[line];
  }
  FrequencyPoint out;
  out.frequency = frequency;
  if (!(uu > 0)) return out;
  out.magnitude = std::abs(uy) / uu;
  out.phase = std::arg(uy);
  if (yy > 0) out.coherence = std::min(1.0, std::norm(uy) / (uu * yy));
  return out;
}

// A point between two others, at a way in [0, 1] of the logarithm of the frequency.
FrequencyPoint between(const FrequencyPoint& a, const FrequencyPoint& b, double way) {
  FrequencyPoint out;
  out.frequency = a.frequency * std::pow(b.frequency / a.frequency, way);
  out.magnitude = a.magnitude * std::pow(b.magnitude / a.magnitude, way);
  out.phase = std::lerp(a.phase, b.phase, way);
  return out;
}

void find_resonance(const std::vector<FrequencyPoint>& points, Bandwidth& out) {
  const auto top = std::ranges::max_element(points, {}, &FrequencyPoint::magnitude);
  out.peak_magnitude = top->magnitude;
  out.peak_frequency = top->frequency;
  if (top == points.begin() || top + 1 == points.end()) return;
  // A parabola over the logarithm of the frequency, by Newton's divided differences.
  const FrequencyPoint &a = top[-1], &b = top[0], &c = top[1];
  const double ab = std::log(b.frequency / a.frequency), bc = std::log(c.frequency / b.frequency);
  const double before = (b.magnitude - a.magnitude) / ab, after = (c.magnitude - b.magnitude) / bc;
  const double bend = (after - before) / (ab + bc);
  if (!(bend < 0)) return;
  const double place = 0.5 * ab - 0.5 * before / bend;  // from a
  out.peak_frequency = a.frequency * std::exp(place);
  out.peak_magnitude = a.magnitude + place * (before + bend * (place - ab));
}

}  // namespace

bool SineSweep::valid() const {
  return low > 0 && high > low && std::isfinite(high) && duration > 0 && std::isfinite(duration) &&
         amplitude > 0 && std::isfinite(amplitude);
}

double SineSweep::end() const {
  const double k = growth(*this);
  const double cycles = std::ceil(cycles_until(*this, duration) * (1 - 1e-12));
  return std::log1p(cycles * k / low) / k;
}

double SineSweep::position_at(double t) const {
  if (t <= 0 || t >= end()) return 0;
  return amplitude * std::sin(kTurn * cycles_until(*this, t));
}

double SineSweep::frequency_at(double t) const {
  return low * std::exp(growth(*this) * t);
}

double SineSweep::max_speed() const {
  return kTurn * frequency_at(end()) * amplitude;
}

std::optional<std::vector<FrequencyPoint>> frequency_response(std::span<const double> input,
                                                              std::span<const double> output, double rate,
                                                              const ResponseOptions& options) {
  const bool usable = rate > 0 && std::isfinite(rate) && options.low > 0 && options.high > options.low &&
                      options.high <= 0.5 * rate && options.points >= 2 && std::isfinite(options.segment);
  if (!usable || input.size() != output.size() || !all_finite(input) || !all_finite(output) ||
      static_cast<double>(input.size()) * options.low < rate ||
      std::ranges::all_of(input, [&](double value) { return value == input.front(); }))
    return std::nullopt;
  const Spectra spectra = spectra_of(input, output, rate, segments_of(input.size(), rate, options.segment));
  const double ratio = std::pow(options.high / options.low, 1.0 / (options.points - 1));
  std::vector<FrequencyPoint> out;
  for (int i = 0; i < options.points; ++i) {
    const double frequency = options.low * std::pow(ratio, i);
    FrequencyPoint point = point_of(spectra, frequency, frequency * (ratio - 1));
    if (!out.empty()) point.phase = out.back().phase + std::remainder(point.phase - out.back().phase, kTurn);
    out.push_back(point);
  }
  return out;
}

std::optional<Bandwidth> bandwidth_of(std::span<const FrequencyPoint> response,
                                      const BandwidthOptions& options) {
  std::vector<FrequencyPoint> points;
  for (const FrequencyPoint& point : response)
    if (point.coherence >= options.min_coherence && point.magnitude > 0) points.push_back(point);
  if (points.size() < 2 || !(options.reference > 0)) return std::nullopt;
  Bandwidth out;
  find_resonance(points, out);
  const double level = options.reference / std::numbers::sqrt2;
  const auto falls_at = [&](std::size_t i) {  // between i - 1 and i, and remains below
    if (points[i - 1].magnitude < level) return false;
    const double range_end = points[i].frequency * std::exp2(1.0 / 6);
    for (std::size_t k = i; k < points.size() && points[k].frequency <= range_end; ++k)
      if (points[k].magnitude >= level) return false;
    return points[i].magnitude < level;
  };
  for (std::size_t i = 1; i < points.size() && !out.frequency; ++i) {
    if (!falls_at(i)) continue;
    const FrequencyPoint &a = points[i - 1], &b = points[i];
    const double way = std::log(level / a.magnitude) / std::log(b.magnitude / a.magnitude);
    const FrequencyPoint corner = between(a, b, way);
    out.frequency = corner.frequency;
    out.phase = corner.phase;
  }
  return out;
}

}  // namespace doppel
