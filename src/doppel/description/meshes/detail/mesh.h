#pragma once
// Common to the readers of mesh formats: triangles as in the file, corner by corner, before scaling and
// merging of vertices.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"

namespace doppel::mesh {

struct TriangleSoup {
  std::vector<Eigen::Vector3f> points;                  // file units
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices into points
  std::optional<Eigen::Vector4f> rgba;
  std::size_t ear_tests = 0;  // spent by add_polygon
  // A part of a file with names of its own: triangles [begin, end).
  struct Part {
    std::vector<std::string> names;
    std::size_t begin = 0, end = 0;
  };
  std::vector<Part> parts;  // of COLLADA only
};

// Reads a file to which the mesh refers, from its folder; empty: it cannot be read.
using Sidecar = std::function<std::string(const std::string& name)>;

// All throw InputError "mesh.unreadable", with the place in the file if possible. Time and memory are bounded
// by the size of `bytes`.
TriangleSoup read_stl(std::string_view bytes, const std::string& name);
TriangleSoup read_obj(std::string_view bytes, const std::string& name, const Sidecar& sidecar);
TriangleSoup read_collada(std::string_view bytes, const std::string& name);
// glTF and other formats of assimp; the colour is that of the first part that has one.
TriangleSoup read_by_assimp(const std::string& path);

// Triangulates a polygon by ear clipping, which is correct for concave polygons. Source: G. Meisters,
// "Polygons have ears", 1975. Corners are indices into soup.points. With more than kMaxPolygonCorners,
// without an ear, or after kMaxEarTests tests in this soup, the rest becomes a fan.
inline constexpr std::size_t kMaxPolygonCorners = 256;
inline constexpr std::size_t kMaxEarTests = 50'000'000;  // a second; good files need a few thousand
void add_polygon(TriangleSoup& soup, const std::vector<std::uint32_t>& corners);

// Throws InputError "mesh.not_fetched" for a pointer of Git LFS.
void refuse_pointer(std::string_view bytes, const std::string& path);
[[noreturn]] void refuse(const std::string& name, int line, std::string message);

}  // namespace doppel::mesh
