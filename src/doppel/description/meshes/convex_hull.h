#pragma once
// The convex hull of points. Source: Barber, Dobkin, Huhdanpaa, "The Quickhull algorithm for convex hulls",
// 1996, in its authors' library Qhull, which MuJoCo uses too.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct ConvexHull {
  std::vector<std::uint32_t> vertices;  // indices of the points that are corners
  double volume = 0;                    // cube of the points' unit; 0: they are in a plane, a line or a point
  // Indices of points, counter-clockwise seen from outside; empty without a volume.
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// For points without a volume, `vertices` are their extremes in some fifty directions. Precondition: the
// points are finite.
DOPPEL_API ConvexHull convex_hull(std::span<const Eigen::Vector3f> points);

// The corners of the convex hull of points in a plane, counter-clockwise. Source: Andrew 1979, monotone
// chains.
DOPPEL_API std::vector<Eigen::Vector2d> convex_outline(std::vector<Eigen::Vector2d> points);

// `count` unit vectors spread evenly over the sphere (Fibonacci lattice).
DOPPEL_API std::vector<Eigen::Vector3d> even_directions(int count);

// Indices of the points that are furthest in each of `directions` directions, each once.
DOPPEL_API std::vector<std::uint32_t> extreme_points(std::span<const Eigen::Vector3f> points, int directions);

}  // namespace doppel
