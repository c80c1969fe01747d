// Masses and tensors compared with the shapes of their links.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/description/meshes/convex_hull.h"
#include "doppel/review/audit/detail/inertia_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr double kMinUsualDensity = 200, kMaxUsualDensity = 12000;  // printed shells to machined lead
constexpr double kPowerSlack = 0.4;                                 // decades, by assuming a solid body
constexpr double kOutside = 0.05;                                   // of the link's size
constexpr double kFarCentre = 2;  // m; nearer, it may be in another link's frame
constexpr double kConcentrated = 0.05;
constexpr double kMatchingGyration = 0.3;  // of that of the shape's volume
constexpr double kPlaceholder = 0.005;     // m: boxes of a millimetre represent frames, not parts
constexpr int kDirections = 60;

double furthest(const LinkShape& shape, const Eigen::Vector3d& p) {
  double out = 0;
  for (const Eigen::Vector3d& corner : shape.hull) out = std::max(out, (corner - p).norm());
  return out;
}

// True where the mass is plausible.
bool check_density(const Link& link, const LinkShape& shape, SuspectUnits& suspects, Findings& out) {
  const double mass = link.inertial->mass;
  const bool closed = shape.solid.volume > 0;
  const double volume = closed ? shape.solid.volume : shape.hull_volume;
  if (!(volume > 0)) return true;
  const double density = mass / volume;
  const double certain = shape.hull_volume > 0 ? mass / shape.hull_volume : density;
  const std::string message =
      fmt::format("{:g} kg in {:.3g} cm^3 are {:.3g} kg/m^3", mass, volume * 1e6, density);
  if (certain > kMaxDensity * 10 && density / 1e3 > kMinUsualDensity && density / 1e3 < kMaxUsualDensity) {
    suspects.all.push_back({UnitOf::mass, 3, &link, message, "in grams"});
    return false;
  }
  if (certain > kMaxDensity || (closed && density < kMinDensity)) {
    out.add("inertia.density", subject(link), link.inertial->source,
            fmt::format("{}, {}", message,
                        density > kMaxDensity ? "denser than any metal that parts are made of"
                                              : "lighter than foam"));
    return density > kMinDensity / 10 && density < kMaxDensity * 10;
  }
  return true;
}

// The centre of mass with the fewest changed signs with which it is inside the shape, as of the other side's
// part.
std::optional<Eigen::Vector3d> inside_with_other_signs(const Link& link, const LinkShape& shape) {
  for (const int signs : {1, 2, 4, 3, 5, 6, 7}) {
    Link changed = link;
    Eigen::Vector3d& com = changed.inertial->origin.xyz;
    for (int axis = 0; axis < 3; ++axis) {
      if ((signs >> axis & 1) != 0) com[axis] = -com[axis];
    }
    if (com != link.inertial->origin.xyz && distance_outside(shape, com) <= 0) return com;
  }
  return std::nullopt;
}

void check_centre(const Link& link, const LinkShape& shape, SuspectUnits& suspects, Findings& out) {
  const Eigen::Vector3d com = link.inertial->origin.xyz;
  const double outside = centre_outside(link, shape);
  if (outside == 0) return;
  const bool in_millimetres = com.norm() > kFarCentre && outside > 3 * shape.size() &&
                              distance_outside(shape, com * 1e-3) <= kOutside * shape.size();
  if (in_millimetres) {
    suspects.all.push_back(
        {UnitOf::centre, 3, &link,
         fmt::format("its centre of mass, {:g} {:g} {:g} m, is {:.3g} m outside of its shape", com.x(),
                     com.y(), com.z(), outside),
         "in millimetres"});
    return;
  }
  const auto inside = inside_with_other_signs(link, shape);
  out.add("inertia.com_outside", subject(link), link.inertial->source,
          fmt::format("its centre of mass is {:.3g} mm outside of its shape, which is {:.3g} mm long{}",
                      outside * 1e3, shape.size() * 1e3,
                      inside ? fmt::format("; at {:g} {:g} {:g} it is inside, so signs may be wrong",
                                           inside->x(), inside->y(), inside->z())
                             : ""));
}

std::string units_of(int power) {
  switch (power) {
    case 3:
      return "g m^2";
    case 6:
      return "kg mm^2";
    case 9:
      return "g mm^2";
    default:
      return fmt::format("1e{} of its unit", -power);
  }
}

// The same moment about every axis, as in placeholders.
bool isotropic(const Components& c) {
  return c[0] == c[3] && c[3] == c[5] && c[1] == 0 && c[2] == 0 && c[4] == 0;
}

// True where the tensor is wrong by a power of a thousand.
bool check_tensor_units(const Link& link, const LinkShape& shape, SuspectUnits& suspects) {
  const Components c = components_of(*link.inertial);
  const double ratio = tensor_of(c).trace() / expected_tensor(shape, link.inertial->mass).trace();
  if (isotropic(c) || !std::isfinite(ratio) || !(ratio > 0)) return false;
  const double decades = std::log10(ratio);
  const int power = static_cast<int>(std::round(decades / 3)) * 3;
  if (power == 0 || std::abs(decades - power) > kPowerSlack) return false;
  suspects.all.push_back(
      {UnitOf::tensor, power, &link,
       fmt::format("its moments of inertia are {:.2g} times those of its shape and mass", ratio),
       "in " + units_of(power)});
  return true;
}

// m, of the mass in the shape, about its longest axis.
double expected_gyration(const LinkShape& shape) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> of(expected_tensor(shape, 1.0),
                                                          Eigen::EigenvaluesOnly);
  return std::sqrt(of.eigenvalues().maxCoeff());
}

// The furthest point of what collides, if that is written besides what is seen; else that of the shape.
double reach_of_collisions(const Link& link, const LinkShape& shape) {
  const Eigen::Vector3d& centre = link.inertial->origin.xyz;
  if (link.visuals.empty() || link.collisions.empty()) return furthest(shape, centre);
  Link solid = link;
  solid.visuals.clear();
  const auto colliding = link_shape(solid);
  return colliding ? furthest(*colliding, centre) : furthest(shape, centre);
}

void check_gyration(const Link& link, const LinkShape& shape, Findings& out) {
  const Inertial& inertial = *link.inertial;
  const double largest = principal_moments(components_of(inertial))[2];
  const double gyration = std::sqrt(largest / inertial.mass);
  const double reach = furthest(shape, inertial.origin.xyz);
  if (!(reach > 0)) return;
  if (gyration > kMaxGyrationRatio * reach) {
    // No repair: drives add the inertia of their rotors, and shapes do not include all parts of a link.
    out.add("inertia.gyration", subject(link), inertial.source,
            fmt::format("they imply mass at {:.3g} mm from its centre, but no point of its shape is more "
                        "than {:.3g} mm away",
                        gyration * 1e3, reach * 1e3));
  } else if (gyration < kConcentrated * reach &&
             gyration < kConcentrated * reach_of_collisions(link, shape) &&
             gyration < kMatchingGyration * expected_gyration(shape)) {
    // A tensor that matches the volume is right; a stray piece of a mesh reaches far and has hardly any
    // volume.
    out.add("inertia.gyration", subject(link), inertial.source,
            fmt::format("they imply all mass within {:.2g} mm of its centre, but its shape extends {:.3g} mm",
                        gyration * 1e3, reach * 1e3));
  }
}

// The shape itself is doubtful: a comparison with it would report the same error again, and
// change valid data.
bool doubted(const Link& link, const Findings& out) {
  const std::string name = subject(link);
  for (const char* rule : {"mesh.unit", "mesh.scale_zero", "shape.units", "shape.zero_size", "urdf.geometry",
                           "urdf.number", "urdf.vector"}) {
    if (out.has(rule, name)) return true;
  }
  return false;
}

// Its meshes are mirrored by mistake, and the centre of mass is right.
bool mirrored(const Link& link, const Findings& out) {
  const auto scale = out.find("mesh.scale_negative", subject(link));
  return scale != nullptr && scale->severity == Severity::error;
}

}  // namespace

double distance_outside(const LinkShape& shape, const Eigen::Vector3d& p) {
  static const std::vector<Eigen::Vector3d> directions = even_directions(kDirections);
  double most = shape.bounds.exteriorDistance(p);
  for (const Eigen::Vector3d& d : directions) {
    double reach = -1e300;
    for (const Eigen::Vector3d& corner : shape.hull) reach = std::max(reach, corner.dot(d));
    most = std::max(most, p.dot(d) - reach);
  }
  return most;
}

double centre_outside(const Link& link, const LinkShape& shape) {
  const double outside = distance_outside(shape, link.inertial->origin.xyz);
  return outside > kOutside * shape.size() ? outside : 0.0;
}

bool computable(const Link& link, const std::optional<LinkShape>& shape) {
  if (!shape || !(shape->solid.volume > 0) || shape->size() < kPlaceholder) return false;
  const double density = link.inertial->mass / shape->solid.volume;
  return density > kMinDensity && density < kMaxDensity;
}

void check_against_shape(const Link& link, const LinkShape& shape, bool sound, SuspectUnits& suspects,
                         Findings& out) {
  if (shape.size() < kPlaceholder || doubted(link, out)) return;
  ++suspects.compared;
  const bool believable = check_density(link, shape, suspects, out);
  if (!mirrored(link, out)) check_centre(link, shape, suspects, out);
  if (!sound || !believable) return;
  if (check_tensor_units(link, shape, suspects) || check_axes(link, shape, out)) return;
  check_gyration(link, shape, out);
}

}  // namespace doppel::audit_rules
