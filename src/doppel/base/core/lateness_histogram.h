#pragma once
// The lateness of a loop's steps, in bins a fifth of an octave wide from 1 microsecond to 4 seconds. add()
// does not allocate.

#include <array>
#include <chrono>
#include <cstdint>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API LatenessHistogram {
 public:
  void add(std::chrono::nanoseconds late);
  // The lateness that a fraction p of the steps does not exceed (upper edge of its bin), microseconds.
  [[nodiscard]] double percentile(double p) const;
  [[nodiscard]] double worst() const { return static_cast<double>(worst_.count()) * 1e-3; }
  [[nodiscard]] std::uint64_t count() const { return count_; }

 private:
  static constexpr int kBins = 112;
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  std::chrono::nanoseconds worst_{0};
};

}  // namespace doppel
