#pragma once
// The heights of a terrain, from the grey values of a PNG or JPEG image as Gazebo reads them (gz-common,
// ImageHeightmap): the first channel, of 8 or 16 bits.

#include <Eigen/Core>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// Each cell of four points is two triangles, divided from its least x and y to its greatest.
struct DOPPEL_API HeightField {
  int columns = 0, rows = 0;                       // points along x and y, at least 2
  Eigen::Vector2d size = Eigen::Vector2d::Zero();  // m, between the outermost points, centred
  std::vector<float> heights;                      // [rows][columns], m; the first at the least x and y

  [[nodiscard]] float at(int column, int row) const {
    return heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(column)];
  }
  // m, in the axes of the terrain.
  [[nodiscard]] Eigen::Vector3d point(int column, int row) const {
    return {(column / (columns - 1.0) - 0.5) * size.x(), (row / (rows - 1.0) - 0.5) * size.y(),
            at(column, row)};
  }
  // Of the triangles at a place in the plane, m; outside, that of the nearest place of the border.
  [[nodiscard]] double height(double x, double y) const;
};

inline constexpr int kMaxHeightmapSide = 4097;  // pixels

// Reads the image of `map`. The first row of the image is at the greatest y. Throws InputError: "heightmap.unreadable" (not a
// PNG or JPEG image, fewer than 2 or more than kMaxHeightmapSide pixels in a row or column), "heightmap.size".
DOPPEL_API HeightField load_heightmap(const Heightmap& map);

}  // namespace doppel
