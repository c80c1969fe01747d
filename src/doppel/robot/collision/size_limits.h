#pragma once
// The range of sizes, masses and distances that can be simulated, the same for every source of bodies: world
// files, SDF, URDF, and what is spawned. Beyond it collision detection of the engines may not end, and a step
// diverges.

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

inline constexpr double kMinShapeSize = 1e-4, kMaxShapeSize = 1e4;  // m
inline constexpr double kMinBodyMass = 1e-6, kMaxBodyMass = 1e6;    // kg
inline constexpr double kMaxDistance = 1e4;                         // m, along each axis

// Each reports an error of the rule at the place if a value is outside its range, with the range.
DOPPEL_API void check_sizes(const Geometry& shape, const char* rule, const SourceLocation& where,
                            Diagnostics& errors);
DOPPEL_API void check_mass(double mass, const char* rule, const SourceLocation& where, Diagnostics& errors);
DOPPEL_API void check_distance(const Pose& pose, const char* rule, const SourceLocation& where,
                               Diagnostics& errors);
// The same for any other value; `unit` may be empty.
DOPPEL_API void check_range(const char* what, double value, double low, double high, const char* unit,
                            const char* rule, const SourceLocation& where, Diagnostics& errors);

// The largest and the smallest size of a shape, m; {0, 0}: it has none of its own, as a mesh.
struct SizeSpan {
  double least = 0, most = 0;
};
[[nodiscard]] DOPPEL_API SizeSpan size_span(const Geometry& shape);

}  // namespace doppel
