#pragma once
// The signed distance of two convex solids: the length of the shortest translation that makes them touch,
// negative where it separates them. Within 1e-7 m, also in symmetric poses, which robots have at zero.
//
// Apart: the distance algorithm of Gilbert, Johnson and Keerthi ("A Fast Procedure for Computing the
// Distance Between Complex Objects in Three-Dimensional Space", 1988) on A - B; it ends when the plane
// through the last support point bounds the distance from below within kGap. Spheres and capsules are a
// point and a segment with a radius, so that their distances are exact.
//
// Overlapping: the expanding polytope of van den Bergh, "Proximity Queries and Penetration Depth
// Computation on 3D Game Objects", 2001. One difference: the polytope inside the difference A - B need not
// contain the origin at the start. The face whose plane the origin is furthest outside of, or least inside,
// is pushed out until it is a face of A - B (depth) or a plane between the two is found (apart).
//
// FCL, which is used here for triangles, has such a polytope too (libccd's), but is no substitute: for 102 of
// 200 pairs of hulls its depth is too large, by up to 15 mm, while this one is within 2 nm of qhull's faces
// of A - B. A pair takes 6 us in FCL and 7 us here (bench_convex), and `doppel check` of an arm would have to
// load FCL, which takes 5 ms.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <variant>
#include <vector>

#include "doppel/base/math/pose.h"
#include "doppel/description/urdf/robot_description.h"

namespace doppel {

struct ConvexPoints {
  Eigen::Matrix3Xd vertices;  // m
};
using ConvexShape = std::variant<Box, Cylinder, Capsule, Sphere, Ellipsoid, ConvexPoints>;

// A shape with a bounding sphere (m) in its frame. It is the sum of a core and a ball: a sphere's core is its
// centre, a capsule's its axis, and that of the others the whole shape.
struct ConvexSolid {
  explicit ConvexSolid(ConvexShape the_shape);
  ConvexShape shape;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;
  double rounding = 0;  // m, radius of the ball
  // Many vertices once more, one coordinate after the other, so that several are computed at once.
  Eigen::Array<double, Eigen::Dynamic, 3> columns = {};

  // The core's point furthest along d (of any length but zero), both in the shape's frame, m.
  [[nodiscard]] Eigen::Vector3d support(const Eigen::Vector3d& d) const;
};

struct ConvexDistance {
  double distance = 0;  // m; negative: the depth
  // m, in A's frame: p_B - p_A is `distance` along the normal.
  Eigen::Vector3d p_A = Eigen::Vector3d::Zero(), p_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_A = Eigen::Vector3d::UnitZ();  // unit, from A to B
};

// The memory of the functions below: used by one thread, and not allocated again after its construction.
struct ConvexWorkspace {
  ConvexWorkspace();
  struct Face {
    std::array<int, 3> corners{};                      // counter-clockwise from outside
    std::array<int, 3> beside{-1, -1, -1};             // face across the edge corners[i], corners[i + 1]
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit, outward
    double distance = 0;  // of its plane from the origin along the normal; negative: the origin is outside
    bool alive = true;
  };
  struct Edge {
    int begin, end, outside;
  };
  std::vector<Eigen::Vector3d> points, points_of_a;
  std::vector<Face> faces;
  std::vector<int> visible, rim_face;
  std::vector<Edge> rim;
};

inline constexpr double kGap = 1e-9;  // m, between the bounds of a distance at the end of the search

// X_AB: B in A's frame. If it is more than `far`, the result is a lower bound of the distance, with witness
// points that are not the nearest ones. Two flat sets of points in one plane do not overlap.
ConvexDistance convex_distance(const ConvexSolid& a, const ConvexSolid& b, const Pose& X_AB, double far,
                               ConvexWorkspace& memory);

// A unit direction in A's frame along which all of B is beyond all of A; nullopt: none is found.
std::optional<Eigen::Vector3d> separating_direction(const ConvexSolid& a, const ConvexSolid& b,
                                                    const Pose& X_AB);

// Whether the signed distance is less than `clearance` (m), which may be negative: faster.
bool convex_closer(const ConvexSolid& a, const ConvexSolid& b, const Pose& X_AB, double clearance,
                   ConvexWorkspace& memory);

}  // namespace doppel
