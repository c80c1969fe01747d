#include "doppel/robot/ik/detail/subproblems.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace doppel {

Eigen::Vector3d turned(const Eigen::Vector3d& v, const Eigen::Vector3d& k, double angle) {
  const Eigen::Vector3d along = k * k.dot(v);
  return along + std::cos(angle) * (v - along) + std::sin(angle) * k.cross(v);
}

Eigen::Matrix3d rotation_about(const Eigen::Vector3d& k, double angle) {
  return Eigen::AngleAxisd(angle, k).toRotationMatrix();
}

std::optional<double> angle_between(const Eigen::Vector3d& p, const Eigen::Vector3d& r,
                                    const Eigen::Vector3d& k) {
  constexpr double kAlong = 1e-9;  // relative: nearer to the axis, the angle is noise
  const Eigen::Vector3d side = k.cross(p);
  const double sine = side.dot(r), cosine = p.dot(r) - k.dot(p) * k.dot(r);
  if (std::sqrt(sine * sine + cosine * cosine) <= kAlong * p.norm() * r.norm()) return std::nullopt;
  return std::atan2(sine, cosine);
}

Angles solve_cosine(double a, double b, double c, const RootMargin& margin) {
  const double radius = std::sqrt(a * a + b * b);
  if (radius == 0 || std::abs(c) > radius * (1 + margin.slack)) return {};
  const double middle = std::atan2(b, a);
  const double half =
      std::clamp(std::acos(std::clamp(c / radius, -1.0, 1.0)), margin.least_gap, M_PI - margin.least_gap);
  if (half < 1e-12) return {1, {middle, 0}};
  return {2, {middle + half, middle - half}};
}

Angles angles_to_plane(const Eigen::Vector3d& h, const Eigen::Vector3d& p, const Eigen::Vector3d& k, double d,
                       const RootMargin& margin) {
  const double along = h.dot(k) * k.dot(p);
  return solve_cosine(h.dot(p) - along, h.dot(k.cross(p)), d - along, margin);
}

}  // namespace doppel
