#pragma once
// Factors into the SI units that doppel computes in: 30 * kDegree is 30 degrees in rad, angle / kDegree is
// the angle in degrees.

#include <numbers>

namespace doppel {

inline constexpr double kDegree = std::numbers::pi / 180.0;

}  // namespace doppel
