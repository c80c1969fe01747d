#include "doppel/sensors/models/counter_random.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "doppel/base/core/fnv_hash.h"

namespace doppel {
namespace {

// Over the bytes of the seed and the name.
std::uint64_t key_of(std::uint64_t seed, std::string_view sensor) {
  std::uint64_t hash = kEmptyHash;
  for (int i = 0; i < 8; ++i) hash = fnv_mixed(hash, seed >> (8 * i) & 0xFF);
  return fnv_hash(sensor, hash);
}

// The quantile of the normal distribution at p. Source: P. Acklam's rational approximation, refined by one step of
// Halley's method.
double normal_quantile(double p) {
  constexpr double a[] = {-3.969683028665376e+01, 2.209460984245205e+02,  -2.759285104469687e+02,
                          1.383577518672690e+02,  -3.066479806614716e+01, 2.506628277459239e+00};
  constexpr double b[] = {-5.447609879822406e+01, 1.615858368580409e+02, -1.556989798598866e+02,
                          6.680131188771972e+01, -1.328068155288572e+01};
  constexpr double c[] = {-7.784894002430293e-03, -3.223964580411365e-01, -2.400758277161838e+00,
                          -2.549732539343734e+00, 4.374664141464968e+00,  2.938163982698783e+00};
  constexpr double d[] = {7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00,
                          3.754408661907416e+00};
  double x = 0;
  if (p < 0.02425 || p > 1 - 0.02425) {
    const double q = std::sqrt(-2 * std::log(p < 0.5 ? p : 1 - p));
    x = (((((c[0] * q + c[1]) * q + c[2]) * q + c[3]) * q + c[4]) * q + c[5]) /
        ((((d[0] * q + d[1]) * q + d[2]) * q + d[3]) * q + 1);
    if (p > 0.5) x = -x;
  } else {
    const double q = p - 0.5, r = q * q;
    x = (((((a[0] * r + a[1]) * r + a[2]) * r + a[3]) * r + a[4]) * r + a[5]) * q /
        (((((b[0] * r + b[1]) * r + b[2]) * r + b[3]) * r + b[4]) * r + 1);
  }
  const double e = 0.5 * std::erfc(-x / std::numbers::sqrt2) - p;
  const double u = e * std::sqrt(2 * std::numbers::pi) * std::exp(x * x / 2);
  return x - u / (1 + x * u / 2);
}

// Philox's counters and, after mix(), their random words; several, so that the compiler works on them side by side.
template <std::size_t kCount>
struct Counters {
  std::uint32_t words[4][kCount];

  void mix(std::uint32_t k0, std::uint32_t k1) {
    for (int round = 0; round < 10; ++round) {
      for (std::size_t c = 0; c < kCount; ++c) {
        const std::uint64_t a = std::uint64_t{0xD2511F53u} * words[0][c],
                            b = std::uint64_t{0xCD9E8D57u} * words[2][c];
        words[0][c] = static_cast<std::uint32_t>(b >> 32) ^ words[1][c] ^ k0;
        words[1][c] = static_cast<std::uint32_t>(b);
        words[2][c] = static_cast<std::uint32_t>(a >> 32) ^ words[3][c] ^ k1;
        words[3][c] = static_cast<std::uint32_t>(a);
      }
      k0 += 0x9E3779B9u;
      k1 += 0xBB67AE85u;
    }
  }
};

const std::vector<float>& quantiles() {
  static const std::vector<float> table = [] {
    std::vector<float> out(65536);
    double squares = 0;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double x = normal_quantile((static_cast<double>(i) + 0.5) / 65536);
      out[i] = static_cast<float>(x);
      squares += x * x;
    }
    const auto scale = static_cast<float>(std::sqrt(65536 / squares));
    for (float& x : out) x *= scale;
    return out;
  }();
  return table;
}

}  // namespace

CounterRandom::CounterRandom(std::uint64_t seed, std::string_view sensor) {
  const std::uint64_t key = key_of(seed, sensor);
  key_[0] = static_cast<std::uint32_t>(key);
  key_[1] = static_cast<std::uint32_t>(key >> 32);
}

std::array<std::uint32_t, 4> CounterRandom::words(std::uint64_t sample, std::uint32_t channel,
                                                  std::uint32_t index) const {
  Counters<1> x{
      {{index}, {channel}, {static_cast<std::uint32_t>(sample)}, {static_cast<std::uint32_t>(sample >> 32)}}};
  x.mix(key_[0], key_[1]);
  return {x.words[0][0], x.words[1][0], x.words[2][0], x.words[3][0]};
}

double CounterRandom::uniform(std::uint64_t sample, std::uint32_t channel, std::uint32_t index) const {
  const auto w = words(sample, channel, index);
  return static_cast<double>((std::uint64_t{w[0]} << 21) ^ (w[1] >> 11)) * 0x1p-53;
}

double CounterRandom::normal(std::uint64_t sample, std::uint32_t channel, std::uint32_t index) const {
  const auto w = words(sample, channel, index);
  const double a = (static_cast<double>(w[0]) + 0.5) * 0x1p-32,
               b = (static_cast<double>(w[1]) + 0.5) * 0x1p-32;
  return std::sqrt(-2 * std::log(a)) * std::cos(2 * std::numbers::pi * b);
}

void CounterRandom::normals(std::uint64_t sample, std::uint32_t channel, std::span<float> out) const {
  const float* const table = quantiles().data();
  constexpr std::size_t kTogether = 16;
  Counters<kTogether> x;
  for (std::size_t at = 0; at < out.size(); at += 8 * kTogether) {
    for (std::size_t c = 0; c < kTogether; ++c) {
      x.words[0][c] = static_cast<std::uint32_t>(at / 8 + c);
      x.words[1][c] = channel;
      x.words[2][c] = static_cast<std::uint32_t>(sample);
      x.words[3][c] = static_cast<std::uint32_t>(sample >> 32);
    }
    x.mix(key_[0], key_[1]);
    const std::size_t count = std::min(out.size() - at, 8 * kTogether);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t word = x.words[i % 8 / 2][i / 8];
      out[at + i] = table[i % 2 == 0 ? word & 0xFFFF : word >> 16];
    }
  }
}

}  // namespace doppel
