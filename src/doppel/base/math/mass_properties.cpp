#include "doppel/base/math/mass_properties.h"

namespace doppel {
namespace {

// Inertia about a point displaced by d from the centre of mass, minus that about the centre of mass,
// per unit mass.
Eigen::Matrix3d parallel_axis(const Eigen::Vector3d& d) {
  return d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose();
}

}  // namespace

MassProperties transformed(const MassProperties& body_F, const Pose& X_GF) {
  const Eigen::Matrix3d R = X_GF.linear();
  return {body_F.mass, X_GF * body_F.com, R * body_F.I * R.transpose()};
}

MassProperties combined(const MassProperties& a, const MassProperties& b) {
  MassProperties sum;
  sum.mass = a.mass + b.mass;
  if (sum.mass <= 0.0) return sum;
  sum.com = (a.mass * a.com + b.mass * b.com) / sum.mass;
  sum.I = a.I + a.mass * parallel_axis(a.com - sum.com) + b.I + b.mass * parallel_axis(b.com - sum.com);
  return sum;
}

SolidProperties solid_properties(std::span<const Eigen::Vector3f> vertices,
                                 std::span<const std::array<std::uint32_t, 3>> triangles) {
  // Sum over tetrahedra (origin, a, b, c): volume, first moment and second moment
  // (covariance) are polynomials.
  double volume = 0.0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const auto& t : triangles) {
    const Eigen::Vector3d a = vertices[t[0]].cast<double>();
    const Eigen::Vector3d b = vertices[t[1]].cast<double>();
    const Eigen::Vector3d c = vertices[t[2]].cast<double>();
    const double v = a.dot(b.cross(c)) / 6.0;
    const Eigen::Vector3d s = a + b + c;
    volume += v;
    first += v * s / 4.0;
    second += v / 20.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  SolidProperties out;
  out.volume = volume;
  if (volume == 0.0) return out;
  out.unit.mass = volume;
  out.unit.com = first / volume;
  const Eigen::Matrix3d about_com = second - volume * out.unit.com * out.unit.com.transpose();
  out.unit.I = about_com.trace() * Eigen::Matrix3d::Identity() - about_com;
  return out;
}

}  // namespace doppel
