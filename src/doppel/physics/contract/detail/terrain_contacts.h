#pragma once
// Contacts of a convex shape with a terrain, for every engine. A contact is where the shape is deepest below a triangle, across a
// ridge between two triangles, or below a peak; its normal is that of the surface there, so that a shape that slides
// over the edges of a plane of triangles does not catch on them. Source: contacts by overlap on the Gauss map of polyhedra
// (D. Gregorius, "The Separating Axis Test between Convex Polyhedra", GDC 2013), with bisection where a shape is round.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

namespace doppel {

// Heights as in HeightField, m after multiplication by `scale`.
struct TerrainView {
  int columns = 0, rows = 0;
  Eigen::Vector2d size = Eigen::Vector2d::Zero();  // m
  const float* heights = nullptr;
  double scale = 1;

  [[nodiscard]] double at(int column, int row) const {
    return scale * heights[static_cast<std::ptrdiff_t>(row) * columns + column];
  }
  [[nodiscard]] Eigen::Vector3d point(int column, int row) const {
    return {(column / (columns - 1.0) - 0.5) * size.x(), (row / (rows - 1.0) - 0.5) * size.y(),
            at(column, row)};
  }
};

struct TerrainContact {
  Eigen::Vector3d p_F = Eigen::Vector3d::Zero();        // m, between the surfaces, in the axes of the terrain
  Eigen::Vector3d normal_F = Eigen::Vector3d::UnitZ();  // unit, out of the terrain
  double distance = 0;                                  // m, negative: penetrating
};

// A convex shape in the axes of the terrain.
class ConvexOnTerrain {
 public:
  ConvexOnTerrain() = default;
  ConvexOnTerrain(const ConvexOnTerrain&) = delete;
  ConvexOnTerrain& operator=(const ConvexOnTerrain&) = delete;
  virtual ~ConvexOnTerrain() = default;
  // The point of the shape that is farthest in a direction.
  [[nodiscard]] virtual Eigen::Vector3d support(const Eigen::Vector3d& direction_F) const = 0;
  [[nodiscard]] virtual Eigen::Vector3d centre() const = 0;
  // Round: without corners, each point of the surface has one normal.
  [[nodiscard]] virtual bool round() const = 0;
  // Points of which some touch a plane first; empty for round shapes.
  [[nodiscard]] virtual int corners() const = 0;
  [[nodiscard]] virtual Eigen::Vector3d corner(int index) const = 0;
  // The contact with a peak inside of the shape; nullopt: it is outside, or the shape has no formula for it.
  [[nodiscard]] virtual std::optional<TerrainContact> with_point(const Eigen::Vector3d& p_F) const = 0;
};

inline constexpr int kMaxTerrainContacts = 8;
struct TerrainContacts {
  int count = 0;
  std::array<TerrainContact, kMaxTerrainContacts> points;
};

// The deepest contact nearer than `margin` (m), and those farthest from it and from each other. Does not allocate.
TerrainContacts terrain_contacts(const TerrainView& field, const ConvexOnTerrain& shape, double margin);

}  // namespace doppel
