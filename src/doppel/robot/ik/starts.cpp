#include "doppel/robot/ik/detail/starts.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace doppel {
namespace {

double radical_inverse(int index, int base) {
  double fraction = 1, out = 0;
  for (; index > 0; index /= base) {
    fraction /= base;
    out += fraction * (index % base);
  }
  return out;
}

}  // namespace

StartRange start_range(const Chain& chain, int variable) {
  const double low = chain.lower[variable], high = chain.upper[variable];
  const double half = chain.turns[static_cast<std::size_t>(variable)] ? M_PI : 1.0;  // rad, m
  if (std::isfinite(low) && std::isfinite(high)) return {low, high};
  if (std::isfinite(low)) return {low, low + 2 * half};
  if (std::isfinite(high)) return {high - 2 * half, high};
  return {-half, half};
}

std::vector<double> halton_starts(const Chain& chain, int count) {
  static constexpr std::array<int, kMaxChainVariables> kPrimes = {
      2,  3,  5,  7,  11, 13, 17, 19, 23, 29,  31,  37,  41,  43,  47,  53,
      59, 61, 67, 71, 73, 79, 83, 89, 97, 101, 103, 107, 109, 113, 127, 131};
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(count) * static_cast<std::size_t>(chain.size()));
  for (int k = 1; k <= count; ++k) {
    for (int v = 0; v < chain.size(); ++v) {
      const StartRange range = start_range(chain, v);
      out.push_back(range.low +
                    (range.high - range.low) * radical_inverse(k, kPrimes[static_cast<std::size_t>(v)]));
    }
  }
  return out;
}

}  // namespace doppel
