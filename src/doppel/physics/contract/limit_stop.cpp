#include "doppel/physics/contract/detail/limit_stop.h"

#include <cmath>
#include <numbers>

namespace doppel {

// The force of a damped impact becomes zero before the depth does, and a stop never pulls: the impact ends at
// the first zero of the force.
double restitution_of(double z) {
  if (!(z > 0)) return 1.0;
  if (std::abs(z - 1.0) < 1e-9) return std::exp(-2.0);
  if (z < 1.0) {
    const double w = std::sqrt(1.0 - z * z);
    return std::exp(-z / w * std::atan2(2.0 * z * w, 2.0 * z * z - 1.0));
  }
  const double w = std::sqrt(z * z - 1.0);
  return std::pow((z + w) / (z - w), -z / w);
}

// Bisection, because equation 22 has no closed inverse and is monotonic; 60 halvings reach double precision.
double damping_ratio_of(double restitution) {
  double less = 0.0, more = kMaxDamped;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (less + more);
    (restitution_of(middle) > restitution ? less : more) = middle;
  }
  return restitution >= 1.0 ? 0.0 : more;
}

}  // namespace doppel
