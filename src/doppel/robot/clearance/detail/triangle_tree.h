#pragma once
// Triangles in a tree of boxes: distances of two sets of triangles and of points, exact but for rounding.

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "doppel/base/math/pose.h"
#include "doppel/robot/clearance/cover_geometry.h"

namespace doppel {

struct Triangle3 {
  Eigen::Vector3d a, b, c;
};

// m; 0 if they cross. Triangles may be segments or points.
double triangle_distance(const Triangle3& first, const Triangle3& second);
// The point of the triangle that is nearest to p. Source: Ericson, "Real-Time Collision Detection", 2005,
// section 5.1.5.
Eigen::Vector3d nearest_point(const Triangle3& triangle, const Eigen::Vector3d& p);

// m, of the longest side.
double longest_side(const Triangle3& triangle);
// Its halves beside the middle of the longest side. A cover is made and proven with the same parts.
std::array<Triangle3, 2> halves(const Triangle3& triangle);

class TriangleTree {
 public:
  TriangleTree() = default;
  explicit TriangleTree(std::vector<Triangle3> triangles);

  [[nodiscard]] bool empty() const { return triangles_.empty(); }
  // m from p, of triangles nearer than `far`; else `far`.
  [[nodiscard]] double distance(const Eigen::Vector3d& p,
                                double far = std::numeric_limits<double>::infinity()) const;
  // m from the triangles of `other`, at X_TO; the same. A distance that is not more than `enough` need not be
  // the least one.
  [[nodiscard]] double distance(const TriangleTree& other, const Pose& X_TO,
                                double far = std::numeric_limits<double>::infinity(),
                                double enough = 0) const;
  // How often the ray from p along `direction` crosses triangles.
  [[nodiscard]] int crossings(const Eigen::Vector3d& p, const Eigen::Vector3d& direction) const;

 private:
  struct Node {
    Eigen::Vector3d centre, half;        // of the box
    double radius = 0;                   // m, of the sphere about `centre` that contains the node
    std::uint32_t first = 0, count = 0;  // triangles of a leaf; count 0: children are `first` and first + 1
  };
  void build(std::uint32_t node, std::uint32_t first, std::uint32_t count);

  std::vector<Triangle3> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace doppel
