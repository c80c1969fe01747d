#pragma once
// An impact of the tool depends on its effective mass and its speed.

#include <Eigen/Core>

#include "doppel/validation/extras/detail/extra_arm.h"

namespace doppel {

struct ToolMobility {
  Eigen::Matrix3d inverse_mass = Eigen::Matrix3d::Zero();  // 1/kg: J M^-1 J^T, root axes
  Eigen::Matrix<double, 3, Eigen::Dynamic> rates;          // m/s per rate of each variable
};

// At the origin of the tool's link, with a payload in kg. Joints outside of the arm stand still. Source:
// Khatib, "Inertial properties in robotic manipulation", IJRR 14(1), 1995.
[[nodiscard]] ToolMobility tool_mobility(const ExtraArm& arm, Data& data, const Eigen::VectorXd& q,
                                         double payload);
// kg: 1 / (u^T J M^-1 J^T u) along a unit vector; infinite where the tool cannot move.
[[nodiscard]] double effective_mass(const ToolMobility& mobility, const Eigen::Vector3d& direction);
// m/s: the largest speed while no joint is faster than its limit; 0 without limits.
[[nodiscard]] double largest_speed(const ExtraArm& arm, const ToolMobility& mobility);

}  // namespace doppel
