#include "doppel/kinematics/link_inertia.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numbers>

#include "doppel/description/mesh.h"

namespace doppel {
namespace {

constexpr double kAssumedDensity = 1000.0;        // kg/m^3: printed plastic with its screws and servos
constexpr double kTriangleTolerance = 1e-6;       // of the largest moment: what is lost by writing few digits
constexpr double kSmallestMomentFraction = 1e-3;  // of the largest: a repaired tensor stays well conditioned

Eigen::Vector3d principal_moments(const Eigen::Matrix3d& I) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I, Eigen::EigenvaluesOnly).eigenvalues();
}

MassProperties solid(double volume, const Eigen::Vector3d& moments_per_mass) {
  const double mass = volume * kAssumedDensity;
  return {mass, Eigen::Vector3d::Zero(), (mass * moments_per_mass).asDiagonal()};
}

MassProperties ball(double mass, double radius) {
  return {mass, Eigen::Vector3d::Zero(), 0.4 * mass * radius * radius * Eigen::Matrix3d::Identity()};
}

MassProperties cylinder(double radius, double length) {
  const double across = (3.0 * radius * radius + length * length) / 12.0;
  return solid(std::numbers::pi * radius * radius * length, {across, across, radius * radius / 2.0});
}

// The solid that a shape encloses, in the shape's frame; mass 0: it encloses nothing.
MassProperties solid_of(const Geometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry)) {
    const Eigen::Vector3d s = box->size.cwiseAbs2() / 12.0;
    return solid(box->size.prod(), {s.y() + s.z(), s.x() + s.z(), s.x() + s.y()});
  }
  if (const auto* c = std::get_if<Cylinder>(&geometry)) return cylinder(c->radius, c->length);
  if (const auto* c = std::get_if<Capsule>(&geometry)) {
    // The caps lengthen the cylinder by two thirds of the radius each: same volume, nearly the same moments.
    return cylinder(c->radius, c->length + 4.0 / 3.0 * c->radius);
  }
  if (const auto* s = std::get_if<Sphere>(&geometry)) {
    return ball(4.0 / 3.0 * std::numbers::pi * s->radius * s->radius * s->radius * kAssumedDensity,
                s->radius);
  }
  const auto& mesh = std::get<MeshGeometry>(geometry);
  if (mesh.path.empty()) return {};
  const TriangleMesh triangles = load_mesh(mesh.path, mesh.scale);
  SolidProperties properties = solid_properties(triangles.vertices, triangles.triangles);
  MassProperties body = properties.unit;
  const double factor = properties.volume < 0 ? -kAssumedDensity : kAssumedDensity;
  body.mass *= factor;
  body.I *= factor;
  return body;
}

template <typename Elements>
MassProperties sum_of_shapes(const Elements& elements) {
  MassProperties sum;
  for (const auto& element : elements) {
    const MassProperties part = solid_of(element.geometry);
    if (part.mass > 0) sum = combined(sum, transformed(part, element.origin.pose()));
  }
  return sum;
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
        "the principal moments of inertia {:.3g}, {:.3g} and {:.3g} kg m^2 break the triangle inequality",
        moments[0], moments[1], moments[2]);
  }
  return "";
}

MassProperties physical_repair(const MassProperties& body) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(body.I);
  Eigen::Vector3d moments = eigen.eigenvalues().cwiseAbs();
  // A tensor of zeros says nothing; a ball of 1 cm radius is the least that a body of that mass can be taken
  // for.
  const double largest = std::max(moments.maxCoeff(), 0.4 * body.mass * 1e-4 * 1e-3);
  moments = moments.cwiseMax(kSmallestMomentFraction * largest);
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
  MassProperties body{inertial.mass, Eigen::Vector3d::Zero(), inertial.tensor()};
  const std::string defect = physical_defect(body);
  if (!defect.empty()) {
    const std::string subject = fmt::format("no rigid body weighs like link '{}': {}", link.name, defect);
    const std::string mend =
        "compute <inertial> from the link's shape and mass (about the centre of mass, kg m^2)";
    if (!(body.mass > 0)) {
      diagnostics.warning("model.not_physical", inertial.source,
                          subject + "; the link counts as without <inertial>", mend);
      return std::nullopt;
    }
    body = physical_repair(body);
    const Eigen::Vector3d moments = principal_moments(body.I);
    diagnostics.warning(
        "model.not_physical", inertial.source,
        fmt::format("{}; taken with the principal moments {:.3g}, {:.3g}, {:.3g} kg m^2 instead", subject,
                    moments[0], moments[1], moments[2]),
        mend);
  }
  return transformed(body, inertial.origin.pose());
}

MassProperties assumed_inertia(const Link& link) {
  MassProperties body;
  try {
    body = sum_of_shapes(link.collisions);
    if (!(body.mass > 0)) body = sum_of_shapes(link.visuals);
  } catch (const InputError&) {
    body = {};  // an unreadable mesh is reported where it is needed as a shape; here it only tells no volume
  }
  if (!(body.mass > 1e-6)) return ball(0.01, 0.01);
  return physical_defect(body).empty() ? body : physical_repair(body);
}

}  // namespace doppel
