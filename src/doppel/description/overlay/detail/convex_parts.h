#pragma once
// A solid as a few convex ones that cover it: cut in two by the plane, parallel to a coordinate plane, that
// minimises the volume of the hulls, and the halves again, as long as a cut reduces it. Greedy after the
// idea of Mamou and Ghorbel, "A simple and efficient approach for 3D mesh approximate convex decomposition",
// 2009 (V-HACD's cuts by axis-aligned planes); exact triangles are clipped here, no voxels.

#include <Eigen/Core>
#include <array>
#include <vector>

namespace doppel::overlay_detail {

using Triangle = std::array<Eigen::Vector3d, 3>;

inline constexpr std::size_t kMaxParts = 12;
inline constexpr double kMinGain = 0.02;  // of the volume of the hull of the whole

// The corners of each part, all within the surface's own hull. A surface that spans no volume has no parts.
std::vector<std::vector<Eigen::Vector3d>> convex_parts(const std::vector<Triangle>& surface);

}  // namespace doppel::overlay_detail
