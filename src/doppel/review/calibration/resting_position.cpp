#include "doppel/review/calibration/resting_position.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace doppel {
namespace {

constexpr std::size_t kSamples = 5;
constexpr double kMaxSpread = 0.005;  // rad or m: three ticks of a servo

}  // namespace

std::optional<double> RestingPosition::take(double sample) {
  if (!std::isfinite(sample)) return {};
  reported_ = true;
  samples_.push_back(sample);
  const auto [least, most] = std::ranges::minmax(samples_);
  if (most - least > kMaxSpread) samples_.assign(1, sample);
  if (samples_.size() < kSamples) return {};
  return std::accumulate(samples_.begin(), samples_.end(), 0.0) / static_cast<double>(samples_.size());
}

InputError RestingPosition::refusal(const std::string& joint) const {
  return {"calibrate.no_position",
          {},
          reported_ ? fmt::format("'{}' moves; a pose is measured at rest", joint)
                    : fmt::format("'{}' reports no position", joint),
          reported_ ? "hold it still" : "its cable and supply; doppel hardware check"};
}

}  // namespace doppel
