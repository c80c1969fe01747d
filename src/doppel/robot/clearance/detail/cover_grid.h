#pragma once
// A shape on a grid: cells of its surface, inside and outside.

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "doppel/robot/clearance/cover_geometry.h"
#include "doppel/robot/clearance/detail/triangle_tree.h"

namespace doppel {

enum class CellKind : std::uint8_t { inside, surface, outside };

class CoverGrid {
 public:
  // About `cells` cells; what the surface separates from the border is inside.
  CoverGrid(const CoverGeometry& shape, double cells);

  [[nodiscard]] double side() const { return side_; }  // m, of a cell
  [[nodiscard]] std::size_t size() const { return kinds_.size(); }
  [[nodiscard]] CellKind kind(std::size_t cell) const { return kinds_[cell]; }
  [[nodiscard]] CellKind kind(const Eigen::Vector3d& p) const;  // outside of the grid: outside
  [[nodiscard]] Eigen::Vector3d centre(std::size_t cell) const;
  // m, of the centre from that of the nearest cell outside.
  [[nodiscard]] double depth(std::size_t cell) const { return side_ * std::sqrt(depths_[cell]); }

  // Points of the surface, up to two in each of its cells beside the outside.
  [[nodiscard]] const std::vector<Eigen::Vector3d>& samples() const { return samples_; }
  // The deepest cell that is not outside, of each block of `block` cells to a side.
  [[nodiscard]] std::vector<std::size_t> deepest_cells(int block) const;

 private:
  using Index = std::array<int, 3>;
  [[nodiscard]] std::size_t cell_of(const Index& i) const;
  [[nodiscard]] Index index_of(const Eigen::Vector3d& p) const;
  void mark(const Triangle3& triangle);
  void flood();
  void measure_depths();
  void take_samples();
  [[nodiscard]] bool beside_outside(std::size_t cell) const;

  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  double side_ = 1;
  Index counts_{1, 1, 1};
  std::vector<CellKind> kinds_;
  std::vector<float> depths_;  // squared, in cells
  // [cells] of the surface the points nearest to the centre, and to the corner that is farthest from the
  // middle of the grid, where spheres leave a shape first.
  struct Nearest {
    float distance = std::numeric_limits<float>::infinity();
    Eigen::Vector3f point = Eigen::Vector3f::Zero();
  };
  std::vector<std::array<Nearest, 2>> nearest_;
  std::vector<Eigen::Vector3d> samples_;
};

}  // namespace doppel
