#include "doppel/validation/metrics/contact_speed.h"

#include <cmath>

namespace doppel {

std::optional<double> reduced_mass(double first, double second) {
  if (!(first > 0) || !(second > 0) || (std::isinf(first) && std::isinf(second))) return std::nullopt;
  return 1 / (1 / first + 1 / second);
}

std::optional<double> max_contact_speed(const ContactLimits& limits, double effective_mass) {
  const auto mass = reduced_mass(limits.human_mass, effective_mass);
  if (!mass || !(limits.force > 0) || !std::isfinite(limits.force) || !(limits.stiffness > 0) ||
      !std::isfinite(limits.stiffness))
    return std::nullopt;
  return limits.force / std::sqrt(limits.stiffness * *mass);
}

}  // namespace doppel
