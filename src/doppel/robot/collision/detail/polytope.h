#pragma once
// The two searches of convex.h work on the Minkowski difference A - B of two cores.

#include <optional>

#include "doppel/robot/collision/detail/convex.h"

namespace doppel {

// A point of A - B.
struct DifferencePoint {
  Eigen::Vector3d p;    // m, in A's axes
  Eigen::Vector3d p_A;  // m, of A; that of B is p_A - p
};

struct SupportDifference {
  const ConvexSolid &a, &b;
  const Pose& X_AB;
  // The point furthest along d.
  [[nodiscard]] DifferencePoint support(const Eigen::Vector3d& d) const {
    const Eigen::Vector3d p_A = a.support(d);
    return {p_A - X_AB * b.support(-(X_AB.linear().transpose() * d)), p_A};
  }
};

inline constexpr std::size_t kMaxPolytopePoints = 400, kMaxPolytopeFaces = 4096;

struct PolytopeDepth {
  double depth = 0;  // m; not more than the threshold: the cores overlap by less than it
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit, from A to B
  std::optional<Eigen::Vector3d> p_A = {};            // m, of A, the deepest in B; absent unless `exact`
};

// The polytope inside A - B, extended by one support point at a time.
class Polytope {
 public:
  Polytope(const SupportDifference& difference, ConvexWorkspace& memory)
      : difference_(difference), m_(memory) {}

  // towards: unit, about from A to B. `exact`: false ends as soon as the depth is known to be more than the
  // threshold or not.
  PolytopeDepth solve(const Eigen::Vector3d& towards, double threshold, bool exact);

 private:
  using Face = ConvexWorkspace::Face;

  bool start(const Eigen::Vector3d& towards);
  bool grow(const DifferencePoint& point, int seen_from);
  int add_face(int i, int j, int k);
  void add_point(const DifferencePoint& point);
  [[nodiscard]] bool above(const Face& face, const Eigen::Vector3d& point) const;
  [[nodiscard]] int nearest_face() const;
  [[nodiscard]] std::optional<Eigen::Vector3d> point_of_a(const Eigen::Vector3d& p, double depth) const;

  const SupportDifference& difference_;
  ConvexWorkspace& m_;
  Eigen::Vector3d flat_normal_ = Eigen::Vector3d::Zero();  // of a difference without volume
};

}  // namespace doppel
