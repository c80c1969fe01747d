#pragma once
// The relative speed of a transient contact that a permitted force allows (ISO/TS 15066:2016, annex A.4.4):
// a spring of the body region between two masses, E = F^2 / (2 k) = mu v^2 / 2.

#include <optional>

#include "doppel/export.h"

namespace doppel {

// kg: 1 / (1 / first + 1 / second); an infinite mass is a fixed body. None unless both are positive.
DOPPEL_API std::optional<double> reduced_mass(double first, double second);

struct ContactLimits {
  double force = 0;       // N: permitted for the body region
  double stiffness = 0;   // N/m: of the body region
  double human_mass = 0;  // kg: of the body region
};

// m/s: F / sqrt(k mu). `effective_mass`: kg, of the robot at the point of contact along the motion.
// None unless all values are positive.
DOPPEL_API std::optional<double> max_contact_speed(const ContactLimits& limits, double effective_mass);

}  // namespace doppel
