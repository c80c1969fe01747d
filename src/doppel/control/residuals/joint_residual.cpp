#include "doppel/control/residuals/joint_residual.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace doppel {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kSettling = 150;  // samples after a restart: the torque rises for a second
constexpr std::size_t kRmsSamples = 200;  // 2 s
constexpr int kRightSamples = 100;        // 1 s without evidence ends an alarm
constexpr std::size_t kJumpSamples = 9;
constexpr int kCauseIsFixed = 100;   // samples after which the cause of an episode stays
constexpr int kMaxRepeats = 6;       // samples: a driver holds the joint after five lost answers
constexpr std::size_t kLoadAge = 6;  // samples that a load is kept at most
constexpr int kRatioLoads = 50, kNoiseLoads = 100;  // after which the ratio and the noise of loads are known
constexpr double kSweeps = 200;                     // that the delay is a mean of: a minute
// The delay is known from a motion of the twin (standard deviation), with the share of it that may remain as
// error, and the contrast between the best and the worst delay.
constexpr double kMinMotion = 0.02, kMaxRemainder = 0.25, kMinContrast = 1.5, kMinVariance = 1e-6;

double square(double x) {
  return x * x;
}

}  // namespace

// The noise before anything is learned: of the error so that |e| above the threshold is evidence at rest, and
// 3 ms of delay; of loads 3 % of the stall torque, and a tenth of the load.
JointResidual::JointResidual(const ResidualOptions& options)
    : ring_(kRing),
      noise_({.s = std::max(options.threshold / kAllowance, options.sigma),
              .c = 0.003,
              .least = std::max(options.threshold / 100, options.sigma),
              .most = std::max(options.threshold / kAllowance, options.sigma)}),
      load_noise_({.s = 0.03, .c = 0.1, .x = 0.2, .least = 0.01}) {
  delay_ = kNone;
  restart();
}

void JointResidual::restart() {
  end_ = filled_ = 0;
  samples_ = 0;
  lag_ = 0;
  age_ = 0;
  error_ = kNone;
  delay_weight_ = 0;  // it may be another one
  score_ = load_score_ = 0;
  repeats_ = right_ = episode_ = 0;
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
  ring_[end_] = {sample.measured, sample.twin, 0, sample.load, sample.model_load, false};
  Row& row = ring_[end_];
  end_ = (end_ + 1) % kRing;
  filled_ = std::min(filled_ + 1, kRing);
  ++samples_;
  row.error = error_ = difference();
  advance_sweep();
  if (samples_ < kSettling || sample.held_back) {
    score_ = load_score_ = 0;
    if (cause_ == ResidualCause::none) return;
  }
  const bool wrong = is_wrong(error_);
  if (cause_ != ResidualCause::none) {
    follow_episode();
  } else if (wrong) {
    ++alarms_;
    episode_ = right_ = 0;
    cause_ = likeliest_cause();
  } else if (is_quiet()) {
    row.quiet = true;
    learn(sample);
  }
}

bool JointResidual::is_wrong(double error) {
  if (!is_repeated()) find_evidence(error);
  return score_ > kDecision || load_score_ > kDecision || largest_jump(kJumpSamples) > kMinJump;
}

void JointResidual::follow_episode() {
  if (right_ >= kRightSamples) {
    cause_ = ResidualCause::none;
    score_ = load_score_ = 0;
  } else if (++episode_ < kCauseIsFixed) {
    // The first signs of one cause can be those of another: a stalled joint has not stood still for long.
    const ResidualCause now = likeliest_cause();
    const bool is_sign = now != ResidualCause::unknown && now != ResidualCause::slipped_horn;
    if (is_sign || cause_ == ResidualCause::unknown) cause_ = now;
  }
}

// While something is wrong, e has other reasons than noise and delay.
bool JointResidual::is_quiet() const {
  return cause_ == ResidualCause::none && score_ <= 0 && load_score_ <= 0;
}

// The reading stands still while the joint moves if answers are lost.
bool JointResidual::is_repeated() {
  repeats_ = filled_ > 1 && back(0).measured == back(1).measured ? repeats_ + 1 : 0;
  if (repeats_ == 0 || repeats_ > kMaxRepeats) return false;
  const double delay = std::isfinite(delay_) ? delay_ / kStep : 0;
  return std::abs(twin_before(delay) - twin_before(delay + repeats_)) > sigma();
}

void JointResidual::find_evidence(double error) {
  const auto add = [](double& score, double z, double allowance) {
    score = std::clamp(score + std::min(z, kMaxScore) - allowance, 0.0, 2 * kDecision);
  };
  const double apart = error / noise_.sigma(speed(0));
  add(score_, std::abs(apart), kAllowance);
  bool right = std::abs(apart) < kAllowance;
  if (loads_ >= kNoiseLoads && has_loads()) {
    const double pushed = load_difference() / load_noise_.sigma(back(0).model_load);
    const double both = std::abs(pushed - apart) / std::numbers::sqrt2;
    add(load_score_, both, kLoadAllowance);
    right = right && both < kLoadAllowance;
  }
  right_ = right ? right_ + 1 : 0;
}

bool JointResidual::has_loads() const {
  return std::isfinite(back(0).load) && std::isfinite(back(0).model_load);
}

// The loads of hardware and twin are shares of stall torques that may differ, a gear has an efficiency, and
// the sign of the measured load is that of the shaft. The result is in the direction of the joint.
double JointResidual::load_difference() const {
  const double delay = std::isfinite(delay_) ? delay_ : kMaxDelay;
  const std::size_t oldest = static_cast<std::size_t>(std::ceil(delay / kStep)) + kLoadAge;
  double least = back(0).model_load, most = least;
  for (std::size_t i = 1; i <= std::min(oldest, filled_ - 1); ++i) {
    least = std::min(least, back(i).model_load);
    most = std::max(most, back(i).model_load);
  }
  const double load = back(0).load / load_ratio_;
  return std::abs(load_ratio_) * (load - std::clamp(load, least, most));
}

// The speed of the twin, with twice its change in 50 ms.
double JointResidual::speed(std::size_t samples) const {
  constexpr double kChange = 5, kWeight = 2;
  const double age = static_cast<double>(samples) + (std::isfinite(delay_) ? delay_ / kStep : 0);
  const auto velocity = [&](double begin) {
    return (twin_before(begin) - twin_before(begin + 2)) / (2 * kStep);
  };
  return std::hypot(velocity(age), kWeight * (velocity(age) - velocity(age + kChange)));
}

// A reading that does not change says nothing new.
void JointResidual::learn(const ResidualSample& sample) {
  if (filled_ < 2) return;
  if (std::isfinite(delay_) && back(0).measured != back(1).measured) noise_.learn(error_, speed(0));
  if (has_loads() && back(0).load != back(1).load) learn_loads(sample);
}

void JointResidual::learn_loads(const ResidualSample& sample) {
  constexpr double kDecay = 1.0 / 3000;  // of a load
  constexpr double kPrior = 0.02, kMinRatio = 0.3, kMaxRatio = 3;
  load_products_ += sample.load * sample.model_load - kDecay * load_products_;
  load_squares_ += square(sample.model_load) - kDecay * load_squares_;
  const double ratio = (kPrior + load_products_) / (kPrior + load_squares_);
  load_ratio_ = std::copysign(std::clamp(std::abs(ratio), kMinRatio, kMaxRatio), ratio);
  if (loads_ >= kRatioLoads) load_noise_.learn(load_difference(), sample.model_load);
  loads_ = std::min(loads_ + 1, kNoiseLoads);
}

// When the delay is first known, the noise of the window that it was found in is too.
void JointResidual::learn_window() {
  for (std::size_t i = kWindow; i-- > 1;) {
    if (!back(i).quiet || back(i).measured == back(i + 1).measured) continue;
    const double age = static_cast<double>(i) + delay_ / kStep;
    noise_.learn(back(i).measured - twin_before(age), speed(i));
  }
}

double JointResidual::sigma() const {
  return noise_.sigma(0);
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
  if (is_quiet()) finish_sweep();
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
  const double weight = (most - least) / (least + kMinVariance);
  delay_weight_ += weight - delay_weight_ / kSweeps;
  if (std::isfinite(delay_)) {
    delay_ += weight / delay_weight_ * (kStep * lag - delay_);
  } else {
    delay_ = kStep * lag;
    learn_window();
  }
}

}  // namespace doppel
