#pragma once
// Spheres that contain a shape, at three levels: one sphere, a few, and many near its surface.
//
// The spheres are chosen greedily among balls about the points of a grid inside the shape, each as large as
// its distance from the outside and a margin that is the smallest with which the number suffices; then they
// are enlarged where a triangle is not yet inside one of them. Where a mesh is open, what its surface
// separates from the outside on the grid counts as inside.
//
// find_hole() proves a cover independently of the search.

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/clearance/cover_geometry.h"

namespace doppel {

inline constexpr double kFineCover = 0.002;  // m: the spheres of level 2 need not be nearer to the surface

struct CoverBudget {
  int coarse = 8, fine = 48;  // spheres of levels 1 and 2; a cover may have a few more
};

struct DOPPEL_API SphereCover {
  std::array<std::vector<CoverSphere>, 3> levels;  // the first has one sphere
  // m: the farthest point of the spheres from the surface outside of the shape, at 256 points of each.
  std::array<double, 3> excess{};
  bool closed = false;  // the shape's surface is, so that the cover has its inside too
};

[[nodiscard]] DOPPEL_API SphereCover make_cover(const CoverGeometry& shape, const CoverBudget& budget);

// A part of a shape that is in no sphere.
struct CoverHole {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // m
  double size = 0;                                  // m, of the part that was looked at
  bool inside = false;                              // false: on the surface
};

inline constexpr double kProofLength = 1e-4;  // m

// nullopt: every triangle of the shape is in the union of the spheres, because it can be split into parts of
// which each is in one ball; parts smaller than kProofLength (m) are holes. The inside of a closed shape is,
// too, because every cell of an octree is in one ball, or outside, or smaller than `resolution` (m) with its
// centre in a ball or with a triangle in it.
[[nodiscard]] DOPPEL_API std::optional<CoverHole> find_hole(std::span<const CoverSphere> spheres,
                                                            const CoverGeometry& shape, double resolution);

// For a check of spheres that somebody wrote: all shapes of a link, each with its pose in the frame of the
// spheres.
struct PlacedGeometry {
  CoverGeometry geometry;
  Pose X_LG = Pose::Identity();
};
[[nodiscard]] DOPPEL_API bool covers(std::span<const CoverSphere> spheres,
                                     std::span<const PlacedGeometry> shapes);
// The hole of the first shape that has one, in the frame of the spheres; nullopt: all are covered.
[[nodiscard]] DOPPEL_API std::optional<CoverHole> find_hole(std::span<const CoverSphere> spheres,
                                                            std::span<const PlacedGeometry> shapes);

}  // namespace doppel
