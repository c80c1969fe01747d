// The proof of a cover.
#include <algorithm>
#include <cmath>

#include "doppel/robot/clearance/detail/triangle_tree.h"
#include "doppel/robot/clearance/sphere_cover.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

// A triangle of which rounding puts a corner out of the ball by less is inside.
constexpr double kProofRounding = 1e-12;  // m

class Prover {
 public:
  explicit Prover(std::span<const CoverSphere> spheres) : spheres_(spheres) {}

  std::optional<CoverHole> triangle(const Triangle3& t) {
    if (contains(last_, t)) return std::nullopt;
    for (std::size_t i = 0; i < spheres_.size(); ++i) {
      if (!contains(i, t)) continue;
      last_ = i;
      return std::nullopt;
    }
    const double size = longest_side(t);
    if (size < kProofLength || in_none(t)) return CoverHole{(t.a + t.b + t.c) / 3, size, false};
    for (const Triangle3& part : halves(t)) {
      if (auto hole = triangle(part)) return hole;
    }
    return std::nullopt;
  }

  std::optional<CoverHole> cell(const TriangleTree& surface, const Vector3d& centre, double side,
                                double resolution) const {
    const double reach = side * std::sqrt(3.0) / 2;
    for (const CoverSphere& s : spheres_) {
      if ((s.centre - centre).norm() + reach <= s.radius) return std::nullopt;
    }
    // Without a triangle in it, a cell is inside or outside as its centre is.
    const bool crossed = surface.distance(centre, reach) < reach;
    if (!crossed && !is_inside(surface, centre)) return std::nullopt;
    if (side < resolution) {
      if (crossed || in_one(centre)) return std::nullopt;
      return CoverHole{centre, side, true};
    }
    for (int i = 0; i < 8; ++i) {
      const Vector3d corner(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
      if (auto hole = cell(surface, centre + corner * (side / 4), side / 2, resolution)) return hole;
    }
    return std::nullopt;
  }

 private:
  [[nodiscard]] bool contains(std::size_t i, const Triangle3& t) const {
    if (i >= spheres_.size()) return false;
    const CoverSphere& s = spheres_[i];
    const double limit = (s.radius + kProofRounding) * (s.radius + kProofRounding);
    return (t.a - s.centre).squaredNorm() <= limit && (t.b - s.centre).squaredNorm() <= limit &&
           (t.c - s.centre).squaredNorm() <= limit;
  }
  [[nodiscard]] bool in_one(const Vector3d& p) const {
    return std::ranges::any_of(
        spheres_, [&](const CoverSphere& s) { return (p - s.centre).norm() <= s.radius + kProofRounding; });
  }
  // Ends a search early: a corner in no sphere is a hole.
  [[nodiscard]] bool in_none(const Triangle3& t) const {
    return !in_one(t.a) || !in_one(t.b) || !in_one(t.c);
  }
  // Two of three rays decide.
  static bool is_inside(const TriangleTree& surface, const Vector3d& p) {
    int odd = 0;
    for (const Vector3d& d :
         {Vector3d(0.9, 0.31, 0.17), Vector3d(-0.23, 0.88, -0.37), Vector3d(0.13, -0.41, -0.79)})
      odd += surface.crossings(p, d) & 1;
    return odd >= 2;
  }

  std::span<const CoverSphere> spheres_;
  std::size_t last_ = 0;
};

}  // namespace

std::optional<CoverHole> find_hole(std::span<const CoverSphere> spheres, const CoverGeometry& shape,
                                   double resolution) {
  if (shape.ball) {
    for (const CoverSphere& s : spheres) {
      if ((s.centre - shape.ball->centre).norm() + shape.ball->radius <= s.radius + kProofRounding)
        return std::nullopt;
    }
    // A ball in several spheres: its surface as a polyhedron around it.
    CollisionShape round{Sphere{shape.ball->radius}};
    round.geometry = Ellipsoid{Vector3d::Constant(shape.ball->radius)};
    CoverGeometry polyhedron = cover_geometry(round);
    for (Vector3d& p : polyhedron.vertices) p += shape.ball->centre;
    return find_hole(spheres, polyhedron, resolution);
  }
  Prover prover(spheres);
  std::vector<Triangle3> triangles;
  Eigen::AlignedBox3d box;
  for (const auto& t : shape.triangles) {
    triangles.push_back({shape.vertices[t[0]], shape.vertices[t[1]], shape.vertices[t[2]]});
    box.extend(triangles.back().a).extend(triangles.back().b).extend(triangles.back().c);
    if (auto hole = prover.triangle(triangles.back())) return hole;
  }
  if (!shape.closed || triangles.empty()) return std::nullopt;
  const TriangleTree surface(std::move(triangles));
  return prover.cell(surface, box.center(), box.sizes().maxCoeff() * 1.001, resolution);
}

std::optional<CoverHole> find_hole(std::span<const CoverSphere> spheres,
                                   std::span<const PlacedGeometry> shapes) {
  for (const PlacedGeometry& placed : shapes) {
    std::vector<CoverSphere> moved(spheres.begin(), spheres.end());
    const Pose X_GL = placed.X_LG.inverse(Eigen::Isometry);
    for (CoverSphere& s : moved) s.centre = X_GL * s.centre;
    double extent = 0;
    for (const Vector3d& p : placed.geometry.vertices) extent = std::max(extent, p.norm());
    auto hole = find_hole(moved, placed.geometry, std::max(extent / 50, 0.002));
    if (!hole) continue;
    hole->point = placed.X_LG * hole->point;
    return hole;
  }
  return std::nullopt;
}

bool covers(std::span<const CoverSphere> spheres, std::span<const PlacedGeometry> shapes) {
  return !find_hole(spheres, shapes);
}

}  // namespace doppel
