#include "doppel/control/residuals/detail/noise_model.h"

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

constexpr double kStartCount = 10;
constexpr double kMemory = 30000;    // errors; five minutes of motion at 100 Hz
constexpr double kMaxDeviation = 3;  // sigmas that an error counts at most

}  // namespace

NoiseModel::NoiseModel(const Start& start) : least_(start.least), most2_(start.most * start.most) {
  const double s2 = start.s * start.s, x2 = start.x * start.x;
  add(s2, 0, kStartCount);
  add(s2 + start.c * start.c * x2, x2, kStartCount);
  solve();
}

double NoiseModel::sigma(double x) const {
  return std::max(least_, std::sqrt(std::min(s2_, most2_) + c2_ * x * x));
}

void NoiseModel::learn(double error, double x) {
  const double e = std::min(std::abs(error), kMaxDeviation * sigma(x));
  if (sums_.n >= kMemory) {
    const double kept = 1 - 1 / kMemory;
    sums_ = {kept * sums_.n, kept * sums_.x2, kept * sums_.x4, kept * sums_.e2, kept * sums_.e2_x2};
  }
  add(e * e, x * x, 1);
  solve();
}

void NoiseModel::add(double e2, double x2, double count) {
  sums_.n += count;
  sums_.x2 += count * x2;
  sums_.x4 += count * x2 * x2;
  sums_.e2 += count * e2;
  sums_.e2_x2 += count * e2 * x2;
}

// Neither variance is negative: where the line would say so, it goes through the origin, or is level.
void NoiseModel::solve() {
  const double mean = sums_.x2 / sums_.n, spread = sums_.x4 - mean * sums_.x2;
  c2_ = spread > 0 ? std::max(0.0, (sums_.e2_x2 - mean * sums_.e2) / spread) : 0;
  s2_ = (sums_.e2 - c2_ * sums_.x2) / sums_.n;
  if (s2_ >= 0) return;
  s2_ = 0;
  c2_ = sums_.e2_x2 / sums_.x4;
}

}  // namespace doppel
