#include "doppel/devices/drivers/detail/release_watch.h"

#include <cmath>

namespace doppel {
namespace {

constexpr Duration kRestBefore{200'000'000};
constexpr int kMaxSilence = 2;                         // cycles
constexpr double kRestBand = 0.005, kGoalBand = 1e-4;  // rad or m

}  // namespace

void RestWatch::take(double value, Time now) {
  if (!std::isfinite(value)) return;
  if (since_ && std::abs(value - middle_) <= band_) return;
  middle_ = value;
  since_ = now;
}

bool RestWatch::is_at_rest(Time now) const {
  return since_ && now - *since_ >= kRestBefore;
}

void ReleaseWatch::begin(const JointRelease& release, double q, Time now) {
  release_ = release;
  begin_ = seen_ = now;
  q_ = q;
  silent_ = 0;
  reason_ = CatchReason::none;
}

CatchReason ReleaseWatch::take(bool fresh, double q, double v, Time now) {
  if (reason_ != CatchReason::none) return reason_;
  silent_ = fresh ? 0 : silent_ + 1;
  if (silent_ >= kMaxSilence) return reason_ = CatchReason::silence;
  if (to_seconds(now - begin_) >= release_.duration) return reason_ = CatchReason::time;
  if (!fresh) return reason_;
  // A servo's own speed lags behind, the difference of two positions is rounded: the larger one counts.
  const double time = to_seconds(now - seen_);
  const double difference = time > 0 ? std::abs(q - q_) / time : 0.0;
  q_ = q;
  seen_ = now;
  if (q <= release_.lower || q >= release_.upper) return reason_ = CatchReason::interval;
  if (difference > release_.speed || std::abs(v) > release_.speed) return reason_ = CatchReason::speed;
  return reason_;
}

void ReleaseWatch::stop() {
  if (reason_ == CatchReason::none) reason_ = CatchReason::stop;
}

JointReleases::JointReleases(std::size_t joints)
    : waits(joints, false),
      positions(joints, RestWatch(kRestBand)),
      goals(joints, RestWatch(kGoalBand)),
      torque_off(joints),
      torque_on(joints) {}

}  // namespace doppel
