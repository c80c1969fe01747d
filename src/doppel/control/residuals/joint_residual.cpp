#include "doppel/control/residuals/joint_residual.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace doppel {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kStep = 0.01;              // s, JointResidual::kPeriod
constexpr std::uint64_t kSettling = 150;    // samples after a restart: the torque rises for a second
constexpr std::size_t kRmsSamples = 200;    // 2 s
constexpr int kWrongSamples = 30;           // 0.3 s above the threshold
constexpr int kRightSamples = 100;          // 1 s below half of it ends an alarm
constexpr std::size_t kCauseSamples = 100;  // 1 s
constexpr double kMinJump = 0.04;           // rad or m in 20 ms, beyond the motion before and after it
constexpr std::size_t kJumpSamples = 9;
constexpr int kCauseIsFixed = 100;  // samples after which the cause of an episode stays
// The delay is known from a motion of the twin (standard deviation), with the share of it that may remain as
// error, and the contrast between the best and the worst delay.
constexpr double kMinMotion = 0.02, kMaxRemainder = 0.25, kMinContrast = 1.5, kMinVariance = 1e-6;

double square(double x) {
  return x * x;
}

}  // namespace

// Motions and loads of the last second, by the aligned twin.
struct JointResidual::Motion {
  double measured = 0, twin = 0;            // range, rad or m
  double recent = 0, recent_twin = 0;       // the same of the last 0.3 s
  double correlation = 0;                   // of the motions in 50 ms
  double jump = 0;                          // rad or m, largest_jump()
  double mean_error = 0, deviation = 0;     // of e in the last 0.3 s
  double load = kNone, model_load = kNone;  // means of the last 0.2 s
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

JointResidual::JointResidual(const ResidualOptions& options) : options_(options), ring_(kRing) {
  delay_ = kNone;
  restart();
}

void JointResidual::restart() {
  end_ = filled_ = 0;
  samples_ = 0;
  lag_ = 0;
  age_ = 0;
  error_ = kNone;
  score_ = 0;
  wrong_ = right_ = episode_ = 0;
  cause_ = ResidualCause::none;
}

double JointResidual::twin_before(double samples) const {
  const auto whole = static_cast<std::size_t>(samples);
  const double rest = samples - static_cast<double>(whole);
  const std::size_t last = filled_ - 1;
  return (1 - rest) * back(std::min(whole, last)).twin + rest * back(std::min(whole + 1, last)).twin;
}

double JointResidual::difference() const {
  const double measured = back(0).measured;
  if (std::isfinite(delay_)) return measured - twin_before(delay_ / kStep);
  double least = back(0).twin, most = least;
  for (std::size_t i = 1; i < std::min<std::size_t>(kLags, filled_); ++i) {
    least = std::min(least, back(i).twin);
    most = std::max(most, back(i).twin);
  }
  return measured - std::clamp(measured, least, most);
}

void JointResidual::add(const ResidualSample& sample) {
  if (!std::isfinite(sample.measured) || !std::isfinite(sample.twin)) return;
  ring_[end_] = {sample.measured, sample.twin, 0, sample.load, sample.model_load};
  end_ = (end_ + 1) % kRing;
  filled_ = std::min(filled_ + 1, kRing);
  ++samples_;
  error_ = difference();
  ring_[(end_ + kRing - 1) % kRing].error = error_;
  advance_sweep();
  learn_loads(sample);
  if (samples_ < kSettling || sample.held_back) {
    score_ = 0;
    wrong_ = 0;
    if (cause_ == ResidualCause::none) return;
  }
  const bool wrong = is_wrong(std::abs(error_));
  if (cause_ == ResidualCause::none) {
    if (!wrong) return;
    ++alarms_;
    episode_ = right_ = 0;
    cause_ = likeliest_cause();
  } else if (right_ >= kRightSamples) {
    cause_ = ResidualCause::none;
    score_ = 0;
  } else if (++episode_ < kCauseIsFixed) {
    // The first signs of one cause can be those of another: a stalled joint has not stood still for long.
    const ResidualCause now = likeliest_cause();
    const bool is_sign = now != ResidualCause::unknown && now != ResidualCause::slipped_horn;
    if (is_sign || cause_ == ResidualCause::unknown) cause_ = now;
  }
}

// The loads of hardware and twin are shares of stall torques that may differ, and a gear has an efficiency.
void JointResidual::learn_loads(const ResidualSample& sample) {
  constexpr double kDecay = 1.0 / 3000;  // of a sample: 30 s
  constexpr double kPrior = 0.02, kMinRatio = 0.3, kMaxRatio = 3;
  if (cause_ != ResidualCause::none || wrong_ > 0 || samples_ < kSettling) return;
  if (!std::isfinite(sample.load) || !std::isfinite(sample.model_load)) return;
  load_products_ += std::abs(sample.load * sample.model_load) - kDecay * load_products_;
  load_squares_ += square(sample.model_load) - kDecay * load_squares_;
  load_ratio_ = std::clamp((kPrior + load_products_) / (kPrior + load_squares_), kMinRatio, kMaxRatio);
}

bool JointResidual::is_wrong(double error) {
  const double limit = options_.sigma > 0 ? kAllowance * options_.sigma : options_.threshold / 2;
  right_ = error < limit ? right_ + 1 : 0;
  wrong_ = error > options_.threshold ? wrong_ + 1 : 0;
  // A servo whose horn slips may have its shaft back at the goal before e has lasted.
  if (filled_ > kJumpSamples && largest_jump(kJumpSamples) > std::max(kMinJump, kMaxScore * options_.sigma))
    return true;
  if (options_.sigma <= 0) return wrong_ >= kWrongSamples;
  score_ = std::max(0.0, score_ + std::min(error / options_.sigma, kMaxScore) - kAllowance);
  score_ = std::min(score_, 2 * kDecision);
  return score_ > kDecision;
}

double JointResidual::rms() const {
  const std::size_t n = std::min(kRmsSamples, filled_);
  if (n == 0) return kNone;
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += square(back(i).error);
  return std::sqrt(sum / static_cast<double>(n));
}

// The variance of e at one delay, over the window that ended when the sweep began.
void JointResidual::advance_sweep() {
  if (filled_ < kRing) return;
  if (lag_ == 0) age_ = 0;
  double sum = 0, squares = 0, twin = 0, twin_squares = 0;
  for (std::size_t i = age_; i < age_ + kWindow; ++i) {
    const double other = back(i + static_cast<std::size_t>(lag_)).twin;
    const double e = back(i).measured - other;
    sum += e;
    squares += e * e;
    twin += other;
    twin_squares += other * other;
  }
  constexpr double n = static_cast<double>(kWindow);
  variances_[static_cast<std::size_t>(lag_)] = std::max(0.0, squares / n - square(sum / n));
  twin_variance_ = std::max(0.0, twin_squares / n - square(twin / n));
  ++age_;
  if (++lag_ < kLags) return;
  lag_ = 0;
  // While something is wrong, e has other reasons than the delay.
  if (cause_ == ResidualCause::none && wrong_ == 0) finish_sweep();
}

void JointResidual::finish_sweep() {
  const auto best = std::ranges::min_element(variances_);
  const double least = *best, most = std::ranges::max(variances_);
  if (twin_variance_ < square(kMinMotion) || least > kMaxRemainder * twin_variance_ ||
      most < kMinContrast * least + kMinVariance)
    return;
  auto lag = static_cast<double>(best - variances_.begin());
  if (best != variances_.begin() && best + 1 != variances_.end()) {
    // The vertex of the parabola through the best lag and its neighbours.
    const double before = *(best - 1), after = *(best + 1), curvature = before - 2 * least + after;
    if (curvature > 0) lag += 0.5 * (before - after) / curvature;
  }
  delay_ = kStep * lag;
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
    squares += square(back(i).error) / static_cast<double>(recent);
  }
  out.deviation = std::sqrt(std::max(0.0, squares - square(out.mean_error)));
  const std::size_t loads = std::min(kLoads, n);
  out.load = out.model_load = 0;
  for (std::size_t i = 0; i < loads; ++i) {
    out.load += back(i).load / static_cast<double>(loads);
    out.model_load += back(i).model_load / static_cast<double>(loads);
  }
  return out;
}

ResidualCause JointResidual::likeliest_cause() const {
  constexpr double kMoves = 0.05, kStill = 0.01, kNoLoad = 0.02, kExtraLoad = 0.03;
  const Motion seen = motion();
  const double load = std::abs(seen.load), model_load = load_ratio_ * std::abs(seen.model_load);
  const bool has_loads = std::isfinite(load) && std::isfinite(model_load);
  // When the twin has arrived, a joint that still stands where it was blocked looks like one with a payload.
  if (cause_ == ResidualCause::stall && seen.measured < kStill) return ResidualCause::stall;
  if (seen.recent > kMoves && seen.recent_twin > kMoves && seen.correlation < -0.5)
    return ResidualCause::wrong_direction;
  if (has_loads && load < kNoLoad && model_load > kNoLoad + kExtraLoad) return ResidualCause::lost_power;
  if (seen.jump > kMinJump) return ResidualCause::slipped_horn;
  if (seen.recent_twin > 2 * kStill && seen.recent < 0.3 * seen.recent_twin) return ResidualCause::stall;
  // A joint that carries more than the twin gives way in the direction of the load. The sign of the measured
  // load is that of the shaft, so that of the twin counts.
  if (has_loads && load > model_load + kExtraLoad && seen.model_load * seen.mean_error <= 0)
    return seen.recent < kStill && load > 0.8 && seen.twin > kMoves ? ResidualCause::stall
                                                                    : ResidualCause::payload;
  if (seen.deviation < 0.2 * std::abs(seen.mean_error) && (!has_loads || load < model_load + kExtraLoad))
    return ResidualCause::slipped_horn;
  return ResidualCause::unknown;
}

}  // namespace doppel
