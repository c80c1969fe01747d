#pragma once
// The mass that the drives of an arm hold in one configuration.

#include <string>

#include "doppel/validation/extras/detail/extra_arm.h"

namespace doppel {

struct HeldMass {
  double mass = kInfinity;  // kg
  int variable = -1;        // of the chain: the drive that allows no more; -1: none does
};

// min over the drives of (eta tau_j - s_j g_j(q)) / |d tau_j / d m| at the tool's payload, not below 0; s_j:
// the direction in which the mass loads the drive. Source: the holding torques are linear in the mass.
[[nodiscard]] HeldMass held_mass(const ExtraArm& arm, Data& data, const Eigen::VectorXd& q, double eta);

}  // namespace doppel
