#pragma once
// The parts of check_inertia.

#include <array>

#include "doppel/review/audit/detail/inertia_facts.h"
#include "doppel/review/audit/detail/rules.h"

namespace doppel::audit_rules {

inline constexpr double kMinDensity = 50, kMaxDensity = 20000;  // kg/m^3: foam; well above lead
inline constexpr double kMaxGyrationRatio =
    1.05;  // radius of gyration against the distance of the furthest point
inline constexpr std::array<const char*, 3> kAxisNames{"x", "y", "z"};

// The shape is closed, and the mass is plausible for its size: a tensor can be computed.
bool computable(const Link& link, const std::optional<LinkShape>& shape);

// A value of one link that is wrong by a power of a thousand: a wrong unit, a placeholder, or a shape that
// does not match the part. Only the agreement of several links shows which.
enum class UnitOf { mass, centre, tensor };
struct SuspectUnit {
  UnitOf of;
  int power;  // it is 10^power times too large
  const Link* link;
  std::string values;  // with their units
  std::string meant;   // "in grams"
};
struct SuspectUnits {
  std::vector<SuspectUnit> all;
  std::size_t compared = 0;  // links whose shape, mass and tensor could be compared
};
void report_units(const SuspectUnits& suspects, Findings& out);  // rules_units.cpp

// Mass, centre of mass and tensor compared with the link's shape. `sound`: the tensor is physically
// possible. rules_inertia_shape.cpp
void check_against_shape(const Link& link, const LinkShape& shape, bool sound, SuspectUnits& suspects,
                         Findings& out);

// The distance of the centre of mass from the link's shape, where it exceeds the tolerance of an estimate;
// 0: inside. rules_inertia_shape.cpp
double centre_outside(const Link& link, const LinkShape& shape);
// The distance of a point from the hull of the shape, m; negative: inside.
double distance_outside(const LinkShape& shape, const Eigen::Vector3d& p);

// True if the values of its <inertial> are numbers; an invalid one was reported by the parser and is 0.
bool readable(const AuditInput& in, const Link& link, const Findings& out);

// True where the moments fit the shape only about other axes. rules_inertia_axes.cpp
bool check_axes(const Link& link, const LinkShape& shape, Findings& out);

// Left and right parts, and parts with the same mesh, whose masses differ. rules_twins.cpp
void check_twins(const AuditInput& in, Findings& out);

}  // namespace doppel::audit_rules
