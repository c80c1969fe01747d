#include "doppel/base/core/lateness_histogram.h"

#include <algorithm>
#include <cmath>

namespace doppel {

void LatenessHistogram::add(std::chrono::nanoseconds late) {
  worst_ = std::max(worst_, late);
  ++count_;
  const double microseconds = static_cast<double>(late.count()) * 1e-3;
  // Five bins for each doubling: a percentile has an error of at most 15 % at any magnitude, in a table of
  // fixed size.
  const int bin = microseconds <= 1.0 ? 0 : 1 + static_cast<int>(5.0 * std::log2(microseconds));
  ++bins_[static_cast<std::size_t>(std::min(bin, kBins - 1))];
}

double LatenessHistogram::percentile(double p) const {
  const auto rank = static_cast<std::uint64_t>(std::ceil(p * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (int bin = 0; bin < kBins; ++bin) {
    seen += bins_[static_cast<std::size_t>(bin)];
    if (seen >= rank && seen > 0) return std::exp2(bin / 5.0);
  }
  return 0.0;
}

}  // namespace doppel
