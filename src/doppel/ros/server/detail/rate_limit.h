#pragma once
// A rate limit with bursts (token bucket).

#include <algorithm>
#include <chrono>

namespace doppel {

class MessageLimit {
 public:
  using Clock = std::chrono::steady_clock;
  MessageLimit(double per_second, double burst) : per_second_(per_second), burst_(burst), left_(burst) {}

  // True if `amount` is within the limit at `now`; if so, it is consumed. Precondition: `now`
  // does not decrease.
  bool take(double amount, Clock::time_point now) {
    left_ = std::min(burst_, left_ + per_second_ * std::chrono::duration<double>(now - last_).count());
    last_ = now;
    if (amount > left_) return false;
    left_ -= amount;
    return true;
  }

 private:
  double per_second_, burst_, left_;
  Clock::time_point last_ = Clock::now();
};

}  // namespace doppel
