#pragma once
// A triple buffer: passes the newest row of numbers from one thread to another. Neither thread waits, and the
// reader never gets a partly written row.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API LatestCopy {
 public:
  explicit LatestCopy(std::span<const double> initial) {
    for (auto& buffer : buffers_) buffer.assign(initial.begin(), initial.end());
  }

  // The writing thread: fills row(), then publishes it with leave().
  [[nodiscard]] std::span<double> row() { return buffers_[writing_]; }
  void leave() { writing_ = between_.exchange(writing_ | kFresh, std::memory_order_acq_rel) & kIndex; }

  // Replaces every row, published or not. Neither thread may use the copy meanwhile.
  void reset(std::span<const double> values) {
    for (auto& buffer : buffers_) std::ranges::copy(values, buffer.begin());
  }

  // The reading thread: the newest published row; the initial one before the first.
  [[nodiscard]] std::span<const double> newest() {
    if ((between_.load(std::memory_order_relaxed) & kFresh) != 0)
      reading_ = between_.exchange(reading_, std::memory_order_acq_rel) & kIndex;
    return buffers_[reading_];
  }

 private:
  static constexpr std::uint32_t kFresh = 4, kIndex = 3;
  std::array<std::vector<double>, 3> buffers_;
  std::uint32_t writing_ = 0, reading_ = 2;
  std::atomic<std::uint32_t> between_{1};
};

}  // namespace doppel
