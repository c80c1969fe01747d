#include <algorithm>
#include <cmath>

#include "doppel/control/residuals/joint_residual.h"

namespace doppel {
namespace {

constexpr std::size_t kCauseSamples = 100;  // 1 s

}  // namespace

// Motions and loads of the last second, by the aligned twin.
struct JointResidual::Motion {
  double measured = 0, twin = 0;         // range, rad or m
  double recent = 0, recent_twin = 0;    // the same of the last 0.3 s
  double correlation = 0;                // of the motions in 50 ms
  double jump = 0;                       // rad or m, largest_jump()
  double mean_error = 0, deviation = 0;  // of e in the last 0.3 s
  double load = 0, model_load = 0;       // means of the last 0.2 s, in the joint's direction
  double most_load = 0;                  // the largest one
};

std::string_view to_string(ResidualCause cause) {
  switch (cause) {
    case ResidualCause::none:
      return "";
    case ResidualCause::unknown:
      return "unknown";
    case ResidualCause::stall:
      return "stall";
    case ResidualCause::payload:
      return "payload";
    case ResidualCause::slipped_horn:
      return "slipped horn";
    case ResidualCause::lost_power:
      return "lost power";
    case ResidualCause::wrong_direction:
      return "wrong direction";
  }
  return "";
}

// The largest motion in 20 ms that is neither one of the 20 ms before nor of those after it: a joint with a
// mass does not stop or start like that. Where samples were late the reading stands still, and then catches
// up with the twin: a jump that makes the error smaller is none.
double JointResidual::largest_jump(std::size_t samples) const {
  constexpr std::size_t kLength = 2;
  double out = 0;
  for (std::size_t i = kLength; i + 2 * kLength < samples; ++i) {
    if (std::abs(back(i).error) <= std::abs(back(i + kLength).error)) continue;
    const double step = back(i).measured - back(i + kLength).measured, sign = step < 0 ? -1 : 1;
    const double after = sign * (back(i - kLength).measured - back(i).measured);
    const double before = sign * (back(i + kLength).measured - back(i + 2 * kLength).measured);
    out = std::max(out, sign * step - std::max({0.0, after, before}));
  }
  return out;
}

JointResidual::Motion JointResidual::motion() const {
  constexpr std::size_t kRecent = 30, kLoads = 20, kChange = 5;
  Motion out;
  const std::size_t n = std::min(kCauseSamples, filled_);
  const std::size_t shift = std::isfinite(delay_) ? static_cast<std::size_t>(std::lround(delay_ / kStep)) : 0;
  const auto twin = [&](std::size_t i) { return back(std::min(i + shift, filled_ - 1)).twin; };
  double low = back(0).measured, high = low, twin_low = twin(0), twin_high = twin_low;
  double products = 0, of_measured = 0, of_twin = 0;
  for (std::size_t i = 0; i < n; ++i) {
    low = std::min(low, back(i).measured);
    high = std::max(high, back(i).measured);
    twin_low = std::min(twin_low, twin(i));
    twin_high = std::max(twin_high, twin(i));
    if (i + 1 == std::min(kRecent, n)) {
      out.recent = high - low;
      out.recent_twin = twin_high - twin_low;
    }
    if (i + kChange >= n) continue;
    const double a = back(i).measured - back(i + kChange).measured, b = twin(i) - twin(i + kChange);
    products += a * b;
    of_measured += a * a;
    of_twin += b * b;
  }
  out.jump = largest_jump(n);
  out.measured = high - low;
  out.twin = twin_high - twin_low;
  if (of_measured > 0 && of_twin > 0) out.correlation = products / std::sqrt(of_measured * of_twin);
  double squares = 0;
  const std::size_t recent = std::min(kRecent, n);
  for (std::size_t i = 0; i < recent; ++i) {
    out.mean_error += back(i).error / static_cast<double>(recent);
    squares += back(i).error * back(i).error / static_cast<double>(recent);
  }
  out.deviation = std::sqrt(std::max(0.0, squares - out.mean_error * out.mean_error));
  const std::size_t loads = std::min(kLoads, n);
  for (std::size_t i = 0; i < loads; ++i) {
    out.load += std::copysign(1.0, load_ratio_) * back(i).load / static_cast<double>(loads);
    out.model_load += std::abs(load_ratio_) * back(i).model_load / static_cast<double>(loads);
    out.most_load = std::max(out.most_load, std::abs(back(i).load));
  }
  return out;
}

ResidualCause JointResidual::likeliest_cause() const {
  constexpr double kMoves = 0.05, kStill = 0.01, kNoLoad = 0.02, kExtraLoad = 0.03;
  const Motion seen = motion();
  const double extra = seen.load - seen.model_load;
  const bool loads = std::isfinite(extra);
  // When the twin has arrived, a joint that still stands where it was blocked looks like one with a payload.
  if (cause_ == ResidualCause::stall && seen.measured < kStill) return ResidualCause::stall;
  if (seen.recent > kMoves && seen.recent_twin > kMoves && seen.correlation < -0.5)
    return ResidualCause::wrong_direction;
  if (loads && seen.most_load < kNoLoad && std::abs(seen.model_load) > kNoLoad + kExtraLoad)
    return ResidualCause::lost_power;
  if (seen.jump > kMinJump) return ResidualCause::slipped_horn;
  if (seen.recent_twin > 2 * kStill && seen.recent < 0.3 * seen.recent_twin) return ResidualCause::stall;
  // A joint that carries more than the twin gives way against the load.
  if (loads && std::abs(extra) > kExtraLoad && extra * seen.load > 0 &&
      std::copysign(1.0, extra) * seen.mean_error < sigma())
    return seen.recent < kStill && seen.most_load > 0.8 && seen.twin > kMoves ? ResidualCause::stall
                                                                              : ResidualCause::payload;
  if (seen.deviation < 0.2 * std::abs(seen.mean_error) && (!loads || std::abs(extra) < kExtraLoad))
    return ResidualCause::slipped_horn;
  return ResidualCause::unknown;
}

}  // namespace doppel
