#include "doppel/robot/kinematics/link_inertia.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/robot/kinematics/link_solid.h"

namespace doppel {
namespace {

constexpr double kTriangleTolerance = 1e-6;  // of the largest moment: rounding of written digits
constexpr double kMinMomentFraction = 1e-3;  // of the largest: a repaired tensor stays well conditioned

Eigen::Vector3d principal_moments(const Eigen::Matrix3d& I) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I, Eigen::EigenvaluesOnly).eigenvalues();
}

// A mass without a tensor has the shape of the link's solid, or of a ball of kAssumedDensity if
// there is none.
MassProperties spread(const Link& link, const Inertial& inertial) {
  MassProperties body = link_solid(link);
  if (!(body.mass > kMinSolidMass) || !physical_defect(body).empty())
    body = solid_ball(std::cbrt(0.75 * inertial.mass / (std::numbers::pi * kAssumedDensity)));
  body.I *= inertial.mass / body.mass;
  body.mass = inertial.mass;
  body.com = inertial.origin.xyz;
  return body;
}

}  // namespace

std::string physical_defect(const MassProperties& body) {
  if (!(body.mass > 0)) return fmt::format("its mass is {} kg", body.mass);
  const Eigen::Vector3d moments = principal_moments(body.I);
  if (!(moments[0] > 0)) {
    return fmt::format("a principal moment of inertia is {:.3g} kg m^2, which is not positive", moments[0]);
  }
  if (moments[2] > moments[0] + moments[1] + kTriangleTolerance * moments[2]) {
    return fmt::format(
        "the principal moments of inertia {:.3g}, {:.3g} and {:.3g} kg m^2 violate the triangle inequality",
        moments[0], moments[1], moments[2]);
  }
  return "";
}

MassProperties physical_repair(const MassProperties& body) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(body.I);
  Eigen::Vector3d moments = eigen.eigenvalues().cwiseAbs();
  // A tensor of zeros gives no scale; a thousandth of the tensor of a ball of 1 cm radius with that mass is
  // the smallest that is used.
  const double largest = std::max(moments.maxCoeff(), 0.4 * body.mass * 1e-4 * 1e-3);
  moments = moments.cwiseMax(kMinMomentFraction * largest);
  for (int i = 0; i < 3; ++i) {
    double& a = moments[(i + 1) % 3];
    double& b = moments[(i + 2) % 3];
    const double excess = moments[i] - (a + b);
    if (excess > 0) {
      a += 0.5 * excess * (1 + 1e-9);
      b += 0.5 * excess * (1 + 1e-9);
    }
  }
  MassProperties repaired = body;
  repaired.I = eigen.eigenvectors() * moments.asDiagonal() * eigen.eigenvectors().transpose();
  return repaired;
}

std::optional<MassProperties> link_inertia(const Link& link, Diagnostics& diagnostics) {
  if (!link.inertial) return std::nullopt;
  const Inertial& inertial = *link.inertial;
  if (!inertial.tensor_written && inertial.mass > 0) return spread(link, inertial);
  MassProperties body{inertial.mass, Eigen::Vector3d::Zero(), inertial.tensor()};
  const std::string defect = physical_defect(body);
  if (!defect.empty()) {
    const std::string subject =
        fmt::format("link '{}' has a physically impossible inertia: {}", link.name, defect);
    const std::string fix =
        "compute <inertial> from the link's shape and mass (about the centre of mass, kg m^2)";
    if (!(body.mass > 0)) {
      diagnostics.warning("model.not_physical", inertial.source,
                          subject + "; the link is treated as without <inertial>", fix);
      return std::nullopt;
    }
    body = physical_repair(body);
    const Eigen::Vector3d moments = principal_moments(body.I);
    diagnostics.warning(
        "model.not_physical", inertial.source,
        fmt::format("{}; the principal moments {:.3g}, {:.3g}, {:.3g} kg m^2 are used instead", subject,
                    moments[0], moments[1], moments[2]),
        fix);
  }
  return transformed(body, inertial.origin.pose());
}

}  // namespace doppel
