#pragma once
// A reach map as files: numbers for other programs, and a drawing.

#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/reach/reach_map.h"

namespace doppel {

// One line for each cell that is in reach: x, y, z (m), share, manipulability, limit_distance.
DOPPEL_API std::string reach_csv(const ReachMap& map);
// The same as points with colours (PLY, ASCII), as point cloud viewers read them.
DOPPEL_API std::string reach_ply(const ReachMap& map);
// All cells: the line "doppel reach map 1", a line of JSON (origin, cell, nx, ny, nz, directions, fields),
// then four little-endian floats a cell, x running fastest: in_reach (0 or 1), share, manipulability,
// limit_distance.
DOPPEL_API std::string reach_binary(const ReachMap& map);

enum class ReachValue { share, manipulability, limit_distance };

struct ReachSlice {
  int axis = 1;      // 0, 1, 2: the plane is across x, y, z
  double where = 0;  // m along the axis
};

// A convex part of the robot at q, or of an object around it that is smaller than 10 m, as points in the root
// link, m.
struct ReachBody {
  std::vector<Eigen::Vector3d> points;
  bool of_robot = true;
};
using ReachBodies = std::vector<ReachBody>;
DOPPEL_API ReachBodies scene_bodies(const CollisionScene& scene, const Eigen::VectorXd& q);

// Slices side by side with the robot's silhouette and the outlines of objects, axes in m and the scale of
// colours.
DOPPEL_API std::string reach_svg(const ReachMap& map, const std::vector<ReachSlice>& slices, ReachValue value,
                                 const ReachBodies& bodies, const std::string& title);

// Red, green, blue of a value 0..1: dark blue over green to yellow. Source: viridis (Smith and van der Walt
// 2015), interpolated between nine of its colours.
struct MapColour {
  int r, g, b;
};
DOPPEL_API MapColour map_colour(double value);

}  // namespace doppel
