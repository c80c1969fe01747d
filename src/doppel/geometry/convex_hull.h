#pragma once
// The convex hull of points. Source: Barber, Dobkin, Huhdanpaa, "The Quickhull algorithm for convex hulls",
// 1996, by its authors' library Qhull, which MuJoCo builds its hulls with too.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct ConvexHull {
  std::vector<std::uint32_t> vertices;  // indices of the points that are corners
  double volume = 0;                    // 0: the points lie in a plane, on a line, in one place
  // Of the points, counter-clockwise seen from outside; none where there is no volume.
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Points that span no volume: `vertices` are their extremes in some fifty directions. Points must be finite.
DOPPEL_API ConvexHull convex_hull(std::span<const Eigen::Vector3f> points);

// `count` directions spread evenly over the sphere (Fibonacci's lattice).
DOPPEL_API std::vector<Eigen::Vector3d> even_directions(int count);

// The points furthest in each direction, each once.
DOPPEL_API std::vector<std::uint32_t> extreme_points(std::span<const Eigen::Vector3f> points, int directions);

}  // namespace doppel
