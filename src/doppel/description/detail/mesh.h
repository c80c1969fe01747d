#pragma once
// What the readers of mesh formats share: triangles as a file gives them, corner by corner, before scale and
// welding.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/core/diagnostic.h"

namespace doppel::mesh {

struct TriangleSoup {
  std::vector<Eigen::Vector3f> points;                  // file units
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices into points
  std::optional<Eigen::Vector4f> rgba;
  std::size_t ear_tests = 0;  // spent by add_polygon
};

// Reads a file that the mesh names, beside it; empty: it cannot be read.
using Sidecar = std::function<std::string(const std::string& name)>;

// All throw InputError "mesh.unreadable" with the place in the file where there is one. Time and memory are
// bounded by the size of `bytes`.
TriangleSoup read_stl(std::string_view bytes, const std::string& name);
TriangleSoup read_obj(std::string_view bytes, const std::string& name, const Sidecar& sidecar);
TriangleSoup read_collada(std::string_view bytes, const std::string& name);
// glTF and whatever else assimp knows. `path` is a regular file of a size that assimp can hold.
TriangleSoup read_by_assimp(const std::string& path);

// Cuts a polygon into triangles: by ears, so that hollow corners stay hollow. Source: G. Meisters, "Polygons
// have ears", 1975. Corners are indices into soup.points; above kMaxPolygonCorners, where no ear is
// found, or once kMaxEarTests corners of this soup have been looked at, a fan.
inline constexpr std::size_t kMaxPolygonCorners = 256;
inline constexpr std::size_t kMaxEarTests = 50'000'000;  // a second; good files need a few thousand
void add_polygon(TriangleSoup& soup, const std::vector<std::uint32_t>& corners);

[[noreturn]] void refuse(const std::string& name, int line, std::string message);

}  // namespace doppel::mesh
