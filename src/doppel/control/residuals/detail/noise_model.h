#pragma once
// The standard deviation of an error, learned from the error itself: sigma^2 = s^2 + (c x)^2, where x says
// how much goes on, as a speed. The squared errors are fitted on x^2 by least squares; a large one counts as
// a moderate one, and old ones are forgotten slowly.

#include <limits>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API NoiseModel {
 public:
  struct Start {
    double s = 0, c = 0;  // before anything is learned: as ten errors at rest, and ten at x
    double x = 1;
    double least = 0;  // sigma is never below
    // s is never above: an error that grows slowly, or was there from the beginning, is not noise.
    double most = std::numeric_limits<double>::infinity();
  };
  explicit NoiseModel(const Start& start);

  [[nodiscard]] double sigma(double x) const;
  void learn(double error, double x);

 private:
  struct Sums {
    double n = 0, x2 = 0, x4 = 0, e2 = 0, e2_x2 = 0;
  };
  void add(double e2, double x2, double count);
  void solve();

  double least_, most2_;
  Sums sums_;
  double s2_ = 0, c2_ = 0;
};

}  // namespace doppel
