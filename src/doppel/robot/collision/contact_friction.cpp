#include "doppel/robot/collision/detail/contact_friction.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace doppel {
namespace {

// Pressure is even over the patch of a round contact: the torque is 3 pi / 16 of that at its rim.
constexpr double kPatchLever = 3.0 * std::numbers::pi / 16.0;

// Of a torsional friction without a coefficient. Source: SDFormat 1.11, torsional/coefficient.
constexpr double kTorsionalFriction = 1.0;

// MuJoCo's cones have one compliance in both directions.
double slip_of(const ContactSurface& surface, const Collision& collision, Diagnostics& diagnostics) {
  const double first = std::max(surface.slip1.value_or(0.0), 0.0);
  const double second = std::max(surface.slip2.value_or(0.0), 0.0);
  if (first != second) {
    diagnostics.warning(
        "physics.slip", collision.source,
        fmt::format(
            "slip1 ({:g}) and slip2 ({:g}) differ; the contacts creep by the smaller one in every direction",
            first, second),
        "use fdir1 with mu1 and mu2 for a wheel that slides more easily in one direction");
  }
  return std::min(first, second);
}

}  // namespace

ContactSurface overlaid(ContactSurface above, const ContactSurface& below) {
  const auto take = [](auto& to, const auto& from) {
    if (from) to = from;
  };
  take(above.mu, below.mu);
  take(above.mu2, below.mu2);
  take(above.torsional_mu, below.torsional_mu);
  take(above.patch_radius, below.patch_radius);
  take(above.slip1, below.slip1);
  take(above.slip2, below.slip2);
  take(above.restitution, below.restitution);
  if (below.fdir1) {
    above.fdir1 = below.fdir1;
    above.fdir1_frame = below.fdir1_frame;
  }
  if (!below.shape.empty()) above.shape = below.shape;
  return above;
}

ContactSurface surface_of(const RobotDescription& robot, const std::string& link) {
  ContactSurface out;
  for (const GazeboExtension& extension : robot.gazebo) {
    if (extension.reference == link) out = overlaid(out, extension.surface);
  }
  return out;
}

Friction friction_of(const ContactSurface& surface, const Model& model, const Collision& collision,
                     Diagnostics& diagnostics) {
  Friction out;
  out.written = surface.mu || surface.mu2;
  out.along = surface.mu.value_or(kDefaultFriction);
  out.across = surface.mu2.value_or(out.along);
  if (surface.fdir1) {
    out.direction = *surface.fdir1;
    if (!surface.fdir1_frame.empty()) {
      out.direction_link = model.find_link(surface.fdir1_frame);
      if (out.direction_link < 0) {
        diagnostics.warning("physics.friction_direction", collision.source,
                            fmt::format("fdir1 is given in the axes of '{}', which is not a link; those of "
                                        "the collision are used",
                                        surface.fdir1_frame));
      }
    }
    if (out.direction_link < 0) out.direction = collision.origin.pose().linear() * out.direction;
    out.decides = out.along != out.across;
  }
  if (!out.directed()) out.across = out.along;
  out.slip = slip_of(surface, collision, diagnostics);
  out.torsion =
      kPatchLever * surface.patch_radius.value_or(0.0) * surface.torsional_mu.value_or(kTorsionalFriction);
  return out;
}

std::optional<double> restitution_of(const ContactSurface& surface, const Collision& collision,
                                     Diagnostics& diagnostics) {
  if (!surface.restitution || (*surface.restitution >= 0 && *surface.restitution <= 1))
    return surface.restitution;
  diagnostics.warning(
      "physics.restitution", collision.source,
      fmt::format("the restitution is {:g}, but must be from 0 to 1; it has no effect", *surface.restitution),
      "write the speed after an impact over that before");
  return std::nullopt;
}

std::string contact_shape_of(const RobotDescription& robot, const Link& link) {
  std::string out = surface_of(robot, link.name).shape;
  for (const Collision& collision : link.collisions) {
    if (!collision.surface.shape.empty()) out = collision.surface.shape;
  }
  return out;
}

}  // namespace doppel
