#pragma once
// The Jacobian of a chain's tip, and what it says about a configuration.

#include <Eigen/Core>

#include "doppel/export.h"
#include "doppel/robot/lanes/chain.h"

namespace doppel {

// [6, variables] of the tip: angular, then linear rates in the base, per rate of each variable. u
// [variables].
DOPPEL_API Eigen::Matrix<double, 6, Eigen::Dynamic> chain_jacobian(const Chain& chain,
                                                                   const Eigen::VectorXd& u);

// The same with lengths divided by the chain's length, so that rows can be compared.
DOPPEL_API Eigen::Matrix<double, 6, Eigen::Dynamic> scaled_jacobian(const Chain& chain,
                                                                    const Eigen::VectorXd& u);

// The volume of the ellipsoid of the tip's velocities for unit rates of the joints, over all `freedom`
// numbers that the arm sets: the product of the largest `freedom` singular values of scaled_jacobian().
// 0: singular. Source: Yoshikawa, "Manipulability of robotic mechanisms", IJRR 4(2),
// 1985.
DOPPEL_API double manipulability(const Chain& chain, const Eigen::VectorXd& u, int freedom);

// The distance of the variable that is nearest to one of its limits, as a part of half its range: 0 at a
// limit, 1 in the middle; 1 without limits.
DOPPEL_API double limit_distance(const Chain& chain, const Eigen::VectorXd& u);

}  // namespace doppel
