#include "doppel/sensors/models/bias_walk.h"

#include <cmath>

namespace doppel {

BiasWalk::BiasWalk(double first, double stddev, double time, double period, const CounterRandom& random,
                   std::uint32_t channel)
    : random_(random), channel_(channel), first_(first), left_{0, first} {
  if (!(stddev > 0) || !(time > 0) || !(period > 0)) return;
  deviation_ = stddev * std::sqrt(time / 2);
  decay_ = period / time;
}

double BiasWalk::draw(std::uint64_t n) {
  ++draws_;
  return random_.normal(n, channel_);
}

double BiasWalk::next_power(const Point& from, std::uint64_t to) {
  const double way = decay_ * static_cast<double>(to - from.n);
  return std::exp(-way) * from.value + deviation_ * std::sqrt(-std::expm1(-2 * way)) * draw(to);
}

// With the correlation r over half the way: mean r (a + b) / (1 + r^2), variance s^2 (1 - r^2) / (1 + r^2).
double BiasWalk::middle(const Point& from, const Point& to) {
  const std::uint64_t half = (to.n - from.n) / 2;
  const double way = decay_ * static_cast<double>(half);
  return (from.value + to.value) / (2 * std::cosh(way)) +
         deviation_ * std::sqrt(std::tanh(way)) * draw(from.n + half);
}

double BiasWalk::at(std::uint64_t n) {
  if (decay_ == 0) return first_;
  if (n < left_.n) {
    left_ = {0, first_};
    rights_ = 0;
  }
  while (rights_ > 0 && right_[rights_ - 1].n <= n) left_ = right_[--rights_];
  while (left_.n != n) {
    if (rights_ == 0) {
      const std::uint64_t to = left_.n == 0 ? 1 : 2 * left_.n;
      const Point next{to, next_power(left_, to)};
      if (to <= n)
        left_ = next;
      else
        right_[rights_++] = next;
      continue;
    }
    const Point& right = right_[rights_ - 1];
    const Point between{left_.n + (right.n - left_.n) / 2, middle(left_, right)};
    if (between.n <= n)
      left_ = between;
    else
      right_[rights_++] = between;
  }
  return left_.value;
}

}  // namespace doppel
