#pragma once

#include <Eigen/Core>
#include <numbers>

namespace doppel {

inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
inline const Eigen::Vector3d kGravity(0, 0, -9.81);  // m/s^2

}  // namespace doppel
