#pragma once
// Properties of a mesh file: size, closedness, volume, hull. Computed once per file and stored in the user's
// cache folder, so that a second request costs a stat and a small read.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/math/mass_properties.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// All in the file's units and frame, before the URDF's scale.
struct DOPPEL_API MeshReport {
  std::string problem;  // not empty: the reason why the file cannot be read
  std::string rule;     // of the problem: "mesh.unreadable"; "audit.skipped" above kMaxMeasuredBytes
  std::string remark;   // not empty: only a lenient reader accepts the file, and the reason
  std::size_t vertices = 0, triangles = 0;
  std::size_t degenerate = 0;  // triangles without area
  std::size_t open_edges = 0;  // edges with one triangle: not watertight
  // Edges whose triangles have inconsistent orientations. Four consistent triangles at one edge, as where two
  // bodies of one file touch, are not counted.
  std::size_t crossed_edges = 0;
  Eigen::Vector3d lower = Eigen::Vector3d::Zero(), upper = Eigen::Vector3d::Zero();  // bounds
  double area = 0;
  SolidProperties solid;              // of the closed surface; the volume is negative if it faces inwards
  std::vector<Eigen::Vector3f> hull;  // vertices of the convex hull, at most kHullVertices
  double hull_volume = 0;
  [[nodiscard]] bool watertight() const { return open_edges == 0 && crossed_edges == 0; }
};
inline constexpr std::size_t kHullVertices = 500;
inline constexpr std::uintmax_t kMaxMeasuredBytes = std::uintmax_t{128} << 20;  // bytes: some seconds

// Does not throw; an error is in `problem`.
DOPPEL_API MeshReport report_mesh(const std::filesystem::path& file);
// The same through the cache ($XDG_CACHE_HOME/doppel, else ~/.cache/doppel; keyed by path, size and time
// of change). Without a writable cache the report is only kept in memory. The reference is valid until
// the program ends.
DOPPEL_API const MeshReport& cached_mesh_report(const std::filesystem::path& file);

// The bytes of a cache file, with version and checksum (mesh_report_cache.cpp). nullopt: they are
// incomplete or invalid.
DOPPEL_API std::string to_bytes(const MeshReport& report, const std::string& key);
DOPPEL_API std::optional<MeshReport> from_bytes(std::string_view bytes, const std::string& key);

// A shape of a link: bounds, solid and hull in m, in the frame of the shape. The solid of a mesh that is not
// watertight is meaningless. nullopt: a plane, or a mesh without a file or with a problem.
struct ShapeReport {
  Eigen::AlignedBox3d bounds;
  SolidProperties solid;
  std::vector<Eigen::Vector3d> hull;
  double hull_volume = 0;  // m^3
  bool watertight = true;
};
DOPPEL_API std::optional<ShapeReport> report_shape(const Geometry& geometry);

}  // namespace doppel
